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

/// Parameters that change the result of guide(); lengths in world units.
struct GuidanceOptions {
    /// standard deviation of a mark's position along each axis, >= 0; automatic: kUniformDeviation of a voxel of the
    /// image
    std::optional<double> mark_precision;
    /// distance from the guess within which the border is searched, >= 0, which is twice the assumed deviation of the
    /// guess; automatic: from the distance to the marks, and as far as the image indicates
    std::optional<double> range;
    /// error of the guess (rms) per distance from the nearest mark, >= 0, if it was measured; automatic: estimated from
    /// the image, but an image that shows another border then makes the guess appear worse
    std::optional<double> error_slope;
    double weight = 1;  ///< in [0,1]: weight of the image's evidence; 0 leaves the guess unchanged
};

template <>
inline constexpr auto kOptions<GuidanceOptions> =
    std::tuple{Option{"mark_precision", &GuidanceOptions::mark_precision, kNotNegative},
               Option{"range", &GuidanceOptions::range, kNotNegative},
               Option{"error_slope", &GuidanceOptions::error_slope, kNotNegative},
               Option{"weight", &GuidanceOptions::weight, kFraction}};

/// What guide() found and did. The defaults mean that nothing ran.
struct GuidanceReport {
    bool used = false;      ///< the image was used
    std::string reason;     ///< why it was not used, as a message for the user
    MarkedFeature feature;  ///< what the image shows at the marks
    double inside = 0, border = 0,
           outside = 0;  ///< median intensities two voxels inside of the marks, there, two voxels outside
    double sigma = 0;    ///< presmoothing: the value that best predicted the marks
    bool local = false;  ///< the profile was learnt locally
    double gain = 0;     ///< what the image adds to the log-likelihood of a mark that was not used for learning, nats
    /// distance from the true border of the one found by the image alone (rms, an upper estimate, at the marks)
    double image_error = 0;
    double guess_error = 0;         ///< distance of the guess from the true border (rms, a lower estimate)
    double confident_fraction = 0;  ///< of the area, where the image is more informative than the guess
    double mean_offset = 0;         ///< by area, outward > 0
    double max_offset = 0;          ///< of |offset|
};

struct Guided {
    FloatGridPtr u;  ///< a level set as from start_from_grid(), on the guess's domain
    GuidanceReport report;
};

/// Moves a guess, between the marks, to where the image shows the same border as at the marks.
///
/// The distribution of brightness at each depth along the surface's normals is learnt at the marks, whatever form it
/// has: a step, a line, or a border that its annotator draws beside the steepest slope. Elsewhere this makes each
/// offset along the normal more or less likely, and a smooth random field about the guess combines these likelihoods.
/// The error of such a field is measured at marks that the profile was not learnt from, as if the guess were no better
/// there than between them; the guess and the field are then averaged according to their variances. If the image does
/// not predict the marks, the guess is left unchanged.
///
/// @param guess  level set, negative inside, on its domain's lattice
/// @param marks  world positions; at least 8 near the guess, or the image is not used
/// @return does not depend on the number of threads
/// @throws Error InvalidOptions, InvalidInput (no surface in the domain), Cancelled.
[[nodiscard]] COVOL_API Guided guide(const FloatGrid& guess, const std::vector<Vec3>& marks, const Image& image,
                                     const GuidanceOptions& options = {}, const RunContext& run = {});

}  // namespace covol
