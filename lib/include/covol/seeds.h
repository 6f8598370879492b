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

/// Positions inside or outside of a structure as given by a file: single points unchanged, lines (scribbles) with
/// additional points between their marks, at most `step` apart; closed lines are closed. World units.
[[nodiscard]] COVOL_API std::vector<Vec3> collect_seeds(const PointCloud& cloud, const ImageGeometry& geometry,
                                                        double step);
/// @throws Error InvalidInput if points need an image.
[[nodiscard]] COVOL_API std::vector<Vec3> collect_seeds(const PointCloud& cloud, double step);

/// The result of checking seeds against a surface.
struct SeedCheck {
    std::size_t inside = 0, outside = 0;              ///< seeds that were checked
    std::size_t painted = 0;                          ///< number of those that are voxels of paint; for warning()
    std::size_t wrong_inside = 0, wrong_outside = 0;  ///< number of seeds on the wrong side
    Vec3 first{0, 0, 0};                              ///< the first seed on the wrong side, world units
    double farthest = 0;  ///< their maximum distance from the surface, limited by the width of the level set

    [[nodiscard]] std::size_t wrong() const { return wrong_inside + wrong_outside; }
    /// One line for the user; empty if no seed is wrong.
    [[nodiscard]] COVOL_API std::string warning() const;
};

/// Finds the seeds that are on the wrong side of a surface by more than `slack` (world units).
/// @param surface  a level set, negative inside
[[nodiscard]] COVOL_API SeedCheck check_seeds(const FloatGrid& surface, const std::vector<Vec3>& inside,
                                              const std::vector<Vec3>& outside, double slack = 0);

/// @throws Error InvalidInput if a position is given as inside and outside (closer than `same`); the message contains
///     it.
COVOL_API void check_sides(const std::vector<Vec3>& inside, const std::vector<Vec3>& outside, double same);

}  // namespace covol
