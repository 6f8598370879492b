#pragma once
#include <memory>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/run.h"

namespace covol {

/// How a surface moved between two images; lengths in world units.
struct MotionReport {
    Vec3 translation{0, 0, 0};  ///< of the whole surface
    double mean_offset = 0;     ///< by area, along the normals, outward > 0; in addition to the translation
    double max_offset = 0;      ///< of |offset|
    /// Correlation of the brightness along the surface's normals in both images, in [-1,1]: how well the surface was
    /// recognised.
    double correlation = 1;
};

struct Followed {
    /// a level set as from start_from_grid(), on the surface's lattice; the same pointer if nothing moved
    FloatGridPtr u;
    MotionReport report;
};

/// A surface and the image's appearance along it, by which it is found in the next image of a time-lapse.
class SurfaceTemplate {
public:
    /// @param surface  level set, negative inside
    /// @param image    in which it lies; need not outlive the constructor
    /// @throws Error InvalidOptions (memory), InvalidInput (no surface), Cancelled.
    COVOL_API SurfaceTemplate(const FloatGridPtr& surface, const Image& image, const RunContext& run = {});

    /// Moves every patch of the surface to where the brightness along its normal is what it was. First a translation of
    /// the whole is found, by pattern search; then offsets along the normals, as a smooth random field whose deviation
    /// is estimated together with it by expectation maximisation. Brightness is compared up to a gain and an offset for
    /// the whole surface. If the image did not change, nothing moves.
    /// @return does not depend on the number of threads
    /// @throws Error InvalidOptions (memory), Cancelled.
    [[nodiscard]] COVOL_API Followed follow(const Image& image, const RunContext& run = {}) const;

    struct Data;

private:
    std::shared_ptr<const Data> data_;
};

}  // namespace covol
