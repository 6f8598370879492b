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
    /// standard deviation of a mark's position along each axis, >= 0; automatic: kUniformDeviation times the image's
    /// voxel
    std::optional<double> mark_precision;
    /// Maximum distance from the guess at which the border is searched, >= 0. Half of it limits the standard deviation
    /// of the guess that is assumed. Automatic: both are estimated from the distances to the marks, the standard
    /// deviation also from the image.
    std::optional<double> range;
    /// Upper limit, >= 0, of the ratio of the root mean square error of the guess to the distance from the nearest
    /// mark, from a measurement (InferenceReport::error_slope). Without it (automatic), this ratio is estimated from
    /// the image alone; the estimate is too large if the image shows another border.
    std::optional<double> error_slope;
    double weight = 1;  ///< in [0,1]: weight of the image's evidence; 0 leaves the guess unchanged
};

template <>
inline constexpr auto kOptions<GuidanceOptions> =
    std::tuple{Option{"mark_precision", &GuidanceOptions::mark_precision, kNotNegative},
               Option{"range", &GuidanceOptions::range, kNotNegative},
               Option{"error_slope", &GuidanceOptions::error_slope, kNotNegative},
               Option{"weight", &GuidanceOptions::weight, kFraction}};

/// What guide() found and did. The default values mean that guide() was not called.
struct GuidanceReport {
    bool used = false;      ///< the image was used
    std::string reason;     ///< why the image was not used, as a message for the user
    MarkedFeature feature;  ///< the kind of edge that the image shows at the marks
    /// median intensities at the marks (border), and two voxels inside and outside of them
    double inside = 0, border = 0, outside = 0;
    double sigma = 0;    ///< the width of the presmoothing with which the image predicted the marks best, world units
    bool local = false;  ///< the intensity profile was estimated separately for different parts of the surface
    double gain = 0;     ///< mean increase, due to the image, of the log-likelihood of a held-out mark, nats
    /// Estimated root mean square distance between the border that the image alone gives and the true border, measured
    /// at held-out marks. It tends to be too large, because a standard error is added.
    double image_error = 0;
    /// Estimated root mean square distance of the guess from the true border. It tends to be too small, because it is
    /// computed from the growth of the error with the distance from the marks, and a standard error is subtracted from
    /// the estimate of this growth.
    double guess_error = 0;
    /// fraction of the area in which the image determines the result more than the guess does
    double confident_fraction = 0;
    double mean_offset = 0;  ///< mean over the area of the movement along the normals, outward > 0
    double max_offset = 0;   ///< maximum of the absolute value of that movement
};

struct Guided {
    FloatGridPtr u;  ///< a level set as from start_from_grid(), on the guess's domain
    GuidanceReport report;
};

/// Moves the parts of a guess between the marks to positions at which the image shows the same border as at the marks.
///
/// The distribution of brightness at each depth along the surface's normals is estimated at the marks; it may have any
/// form, for example a step, a line, or a border drawn beside the steepest slope. At other positions it gives the
/// likelihood of each offset along the normal, and a smooth random field about the guess combines these likelihoods.
/// The error of this field is measured at held-out marks, with the deviation of the guess assumed to be the same at the
/// marks as between them; the guess and the field are then averaged, weighted by their variances. If the image does not
/// predict the marks, the guess is left unchanged.
///
/// @param guess  level set, negative inside, on its domain's lattice
/// @param marks  world positions; the image is not used if fewer than 8 places of the guess have marks near them
/// @return the result, which does not depend on the number of threads
/// @throws Error InvalidOptions, InvalidInput (no surface in the domain), Cancelled.
[[nodiscard]] COVOL_API Guided guide(const FloatGrid& guess, const std::vector<Vec3>& marks, const Image& image,
                                     const GuidanceOptions& options = {}, const RunContext& run = {});

}  // namespace covol
