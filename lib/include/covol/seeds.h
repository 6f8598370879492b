#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/points.h"
#include "covol/run.h"

namespace covol {

/// Positions inside or outside of a structure as a file gives them: loose points as they are, lines (scribbles) with
/// points between their marks, no farther apart than `step`; closed lines are closed. World units.
[[nodiscard]] COVOL_API std::vector<Vec3> collect_seeds(const PointCloud& cloud, const ImageGeometry& geometry,
                                                        double step);
/// @throws Error InvalidInput when points need an image.
[[nodiscard]] COVOL_API std::vector<Vec3> collect_seeds(const PointCloud& cloud, double step);

/// Seeds against a surface.
struct SeedCheck {
    std::size_t inside = 0, outside = 0;              ///< seeds that were checked
    std::size_t painted = 0;                          ///< those of them that are voxels of paint; for warning()
    std::size_t wrong_inside = 0, wrong_outside = 0;  ///< those of all on the wrong side
    Vec3 first{0, 0, 0};                              ///< the first of the wrong ones, world units
    double farthest = 0;                              ///< of them from the surface; no more than the level set knows

    [[nodiscard]] std::size_t wrong() const { return wrong_inside + wrong_outside; }
    /// One line for people; empty where no seed is wrong.
    [[nodiscard]] COVOL_API std::string warning() const;
};

/// Which seeds a surface has on the wrong side, by more than `slack` (world units).
/// @param surface  a level set, negative inside
[[nodiscard]] COVOL_API SeedCheck check_seeds(const FloatGrid& surface, const std::vector<Vec3>& inside,
                                              const std::vector<Vec3>& outside, double slack = 0);

/// @throws Error InvalidInput when a position is named inside and outside (closer than `same`): says where.
COVOL_API void check_sides(const std::vector<Vec3>& inside, const std::vector<Vec3>& outside, double same);

}  // namespace covol
