#pragma once
#include <memory>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/run.h"

namespace covol {

/// How a surface moved between two images; lengths in world units.
struct MotionReport {
    Vec3 translation{0, 0, 0};  ///< movement of the whole surface
    /// mean over the area of the movement along the normals, outward > 0, in addition to the translation
    double mean_offset = 0;
    double max_offset = 0;  ///< maximum of the absolute value of that movement
    /// Correlation of the brightness along the surface's normals in both images, in [-1,1]: a low value means that the
    /// surface was probably lost.
    double correlation = 1;
};

struct Followed {
    /// a level set as from start_from_grid(), on the surface's lattice; the template's own grid if nothing moved
    FloatGridPtr u;
    MotionReport report;
};

/// A surface and the brightness of the image around it, with which it is found in the next image of a time-lapse.
class SurfaceTemplate {
public:
    /// @param surface  level set, negative inside
    /// @param image    in which the surface lies; need not outlive the constructor
    /// @throws Error InvalidOptions (more memory needed than the budget allows), InvalidInput (no surface), Cancelled.
    COVOL_API SurfaceTemplate(const FloatGridPtr& surface, const Image& image, const RunContext& run = {});

    /// Moves every patch of the surface to the position at which the brightness along its normal is most similar to the
    /// previous one. First, a translation of the whole surface is found by pattern search; then offsets along the
    /// normals are found as a smooth random field, whose deviation is estimated together with the field by expectation
    /// maximisation. Brightness is compared up to a gain and an offset for the whole surface. If the image did not
    /// change, nothing moves.
    /// @return the result, which does not depend on the number of threads
    /// @throws Error InvalidOptions (more memory needed than the budget allows), Cancelled.
    [[nodiscard]] COVOL_API Followed follow(const Image& image, const RunContext& run = {}) const;

    struct Data;

private:
    std::shared_ptr<const Data> data_;
};

}  // namespace covol
