#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/image.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// The quantity s in the edge detector g(s), Eq. (2) of the paper, computed from the image normalised to [0,1].
enum class EdgeFeature {
    Automatic,   ///< detect_edges() uses Slope; segment() chooses by the image at the marks of contours, if there
                 ///< are any, see detect_feature()
    Slope,       ///< s = |∇G_σ * I| per world unit: borders between darker and brighter regions, as in the paper
    BrightLine,  ///< s = G_σ * I: bright sheets such as stained membranes, which have no slope in the middle and one on
                 ///< each side
    DarkLine  ///< s = 1 - G_σ * I: dark sheets
};
template <>
inline constexpr auto kWords<EdgeFeature> = std::array{"auto", "slope", "bright-line", "dark-line"};
[[nodiscard]] inline bool is_line(EdgeFeature feature) {
    return feature == EdgeFeature::BrightLine || feature == EdgeFeature::DarkLine;
}

struct EdgeOptions {
    EdgeFeature feature = EdgeFeature::Automatic;
    std::optional<double> sigma;          ///< σ >= 0, world units: width of the presmoothing; automatic: 1 voxel
    std::optional<double> edge_k;         ///< K > 0 in g = 1/(1+K s^2); automatic: from edge_contrast
    std::optional<double> edge_contrast;  ///< s > 0 at which g = 1/2, i.e. K = 1/s^2; automatic: a percentile of s in
                                          ///< the band
    /// percentile of s in the band that is used as the automatic edge_contrast, as a fraction in (0,1); automatic: 0.9
    /// for EdgeFeature::Slope. For BrightLine and DarkLine, edge_contrast is then a third of the median of s, so that g
    /// depends on the brightness relative to the surroundings.
    std::optional<double> contrast_percentile;
    /// intensities mapped to 0 and 1, ascending; automatic: 0.5 % and 99.5 % percentiles near the band
    std::optional<std::array<double, 2>> intensities;
};

template <>
inline constexpr auto kOptions<EdgeOptions> = std::tuple{
    Option{"sigma", &EdgeOptions::sigma, kLength, with_image(Group::Edges), "presmoothing of the image", "1vx"},
    Option{"edge_feature", &EdgeOptions::feature, with_image(Group::Edges),
           "kind of edges: borders between darker and brighter regions, or bright or dark sheets such as membranes",
           "with contours what their marks lie on, else slope", "slope"},
    Option{"edge_k", &EdgeOptions::edge_k, kPositive, with_image(Group::Edges), "K in g = 1/(1 + K s^2)",
           "see `edge_contrast`"},
    Option{"edge_contrast", &EdgeOptions::edge_contrast, kPositive, with_image(Group::Edges),
           "gradient (per world unit) or brightness of lines at which g = 1/2, in the image scaled to [0,1]; not with "
           "`edge_k`",
           "90th percentile in the band, for lines a third of the median"},
    Option{"contrast_percentile", &EdgeOptions::contrast_percentile, kBetween0And1},
    Option{"intensities", &EdgeOptions::intensities},
    Rule<EdgeOptions>{"intensities", "the darker one first",
                      [](const EdgeOptions& o) { return !o.intensities || (*o.intensities)[0] < (*o.intensities)[1]; }},
    Rule<EdgeOptions>{"edge_contrast", "no `edge_k` at the same time",
                      [](const EdgeOptions& o) { return !o.edge_k || !o.edge_contrast; }}};

struct EdgeReport {
    double sigma = 0;                          ///< width of the presmoothing, world units
    double edge_k = 0;                         ///< K as used
    double edge_contrast = 0;                  ///< 1/sqrt(K)
    double low = 0, high = 0;                  ///< intensities that were mapped to 0 and 1
    EdgeFeature feature = EdgeFeature::Slope;  ///< as used, never Automatic
};

struct EdgeResult {
    FloatGridPtr grid;  ///< named "edge": g in (0,1], active in the active voxels of `topology`, background 1
    EdgeReport report;
};

/// Edge detector g = 1/(1 + K s^2), Eq. (2), on the active voxels of `topology`.
/// The image is sampled in these voxels and some layers around them, normalised, and smoothed by the implicit heat
/// equation over time σ²/2; |∇I| is the mean over the 24 tetrahedra into which each voxel is divided.
/// @throws Error InvalidOptions, InvalidInput (no active voxel; the image is constant).
[[nodiscard]] COVOL_API EdgeResult detect_edges(const Image& image, const FloatGrid& topology,
                                                const EdgeOptions& options = {}, const RunContext& run = {});

/// The kind of edge that the image shows at marked positions, averaged over them.
struct MarkedFeature {
    EdgeFeature feature = EdgeFeature::Slope;
    double line = 0;  ///< mean intensity at the positions minus the mean intensity on both sides of them
    double step = 0;  ///< half the difference between the mean intensities outside and inside
};

/// Finds a line if the intensity at the marked positions differs from both sides by more than the sides differ from
/// each other, and by more than four standard errors; else a slope.
/// @param places   positions, world units
/// @param normals  outward unit vectors, one for each position
/// @param reach    distance from a position at which its two sides are sampled, world units
[[nodiscard]] COVOL_API MarkedFeature detect_feature(const Image& image, const std::vector<Vec3>& places,
                                                     const std::vector<Vec3>& normals, double reach);

}  // namespace covol
