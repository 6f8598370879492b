#pragma once
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/edge.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// What changes the result of guide(); lengths in world units.
struct GuidanceOptions {
    /// standard deviation of a mark's place along each axis, >= 0; automatic: kUniformDeviation of a voxel of the image
    std::optional<double> mark_precision;
    /// how far from the guess the border is looked for, >= 0, and so twice the deviation that it may have; automatic:
    /// by the distance to the marks, and as far as the image says
    std::optional<double> range;
    /// how far off the guess may lie (rms), per distance from the nearest mark, >= 0, if that was measured: an image
    /// that shows another border says that the guess is worse; automatic: what the image says
    std::optional<double> error_slope;
    double weight = 1;  ///< in [0,1]: share of what the image says that counts; 0 leaves the guess as it is
};

template <>
inline constexpr auto kOptions<GuidanceOptions> =
    std::tuple{Option{"mark_precision", &GuidanceOptions::mark_precision, kNotNegative},
               Option{"range", &GuidanceOptions::range, kNotNegative},
               Option{"error_slope", &GuidanceOptions::error_slope, kNotNegative},
               Option{"weight", &GuidanceOptions::weight, kFraction}};

/// What guide() saw and did. The defaults say that nothing ran.
struct GuidanceReport {
    bool used = false;      ///< the image had a say
    std::string reason;     ///< why it had none, in plain words
    MarkedFeature feature;  ///< what the image has at the marks
    double inside = 0, border = 0,
           outside = 0;  ///< median intensities two voxels inside of the marks, there, two voxels outside
    double sigma = 0;    ///< presmoothing, the one that foretold the marks best
    bool local = false;  ///< the profile was learnt place by place
    double gain = 0;     ///< what the image adds to the log-likelihood of a mark that it was not learnt from, nats
    /// how far off the border the image alone would lie (rms, an upper estimate, at the marks)
    double image_error = 0;
    double guess_error = 0;         ///< how far off the border the guess lies (rms, a lower estimate)
    double confident_fraction = 0;  ///< of the area, where the image says more than the guess
    double mean_offset = 0;         ///< by area, outward > 0
    double max_offset = 0;          ///< of |offset|
};

struct Guided {
    FloatGridPtr u;  ///< a level set as start_from_grid() gives, on the guess's domain
    GuidanceReport report;
};

/// Moves a guess to where the image shows, between the marks, the border that it shows at the marks.
///
/// How often each brightness occurs at each depth along the surface's normals is learnt at the marks, whatever it is: a
/// step, a line, or a border that its annotator draws beside the steepest slope. Elsewhere this makes each offset along
/// the normal more or less likely, and a smooth random field about the guess weighs that. How far off such a field
/// lies is measured at marks that the profile was not learnt from, as if the guess were no better there than between
/// them; the guess and the field are then averaged by their variances. An image that does not foretell the marks leaves
/// the guess as it is.
///
/// @param guess  level set, negative inside, on its domain's lattice
/// @param marks  world positions; at least 8 near the guess, or the image is not used
/// @return does not depend on the number of threads
/// @throws Error InvalidOptions, InvalidInput (no surface in the domain), Cancelled.
[[nodiscard]] COVOL_API Guided guide(const FloatGrid& guess, const std::vector<Vec3>& marks, const Image& image,
                                     const GuidanceOptions& options = {}, const RunContext& run = {});

}  // namespace covol
