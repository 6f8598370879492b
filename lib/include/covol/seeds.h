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

/// The seeds of a cloud in world units: single points unchanged, lines (scribbles) with additional points, so that
/// neighbouring ones are at most `step` apart, also between the last and the first mark of a closed line.
[[nodiscard]] COVOL_API std::vector<Vec3> collect_seeds(const PointCloud& cloud, const ImageGeometry& geometry,
                                                        double step);
/// The seeds of a cloud in world units, with additional points on lines that are at most `step` apart, without an
/// image.
/// @throws Error InvalidInput if the points need an image.
[[nodiscard]] COVOL_API std::vector<Vec3> collect_seeds(const PointCloud& cloud, double step);

/// The result of checking seeds against a surface.
struct SeedCheck {
    std::size_t inside = 0, outside = 0;  ///< seeds that were checked
    std::size_t painted = 0;  ///< number of these seeds that are voxels of paint, which warning() names as such
    std::size_t wrong_inside = 0, wrong_outside = 0;  ///< number of seeds on the wrong side
    Vec3 first{0, 0, 0};                              ///< the first seed on the wrong side, world units
    /// maximum distance of the wrong seeds from the surface, world units; at most the half width of the level set's
    /// band
    double farthest = 0;

    [[nodiscard]] std::size_t wrong() const { return wrong_inside + wrong_outside; }
    /// One line for the user; empty if no seed is wrong.
    [[nodiscard]] COVOL_API std::string warning() const;
};

/// Finds the seeds that are on the wrong side of a surface by more than `slack` (world units).
/// @param surface  a level set, negative inside
[[nodiscard]] COVOL_API SeedCheck check_seeds(const FloatGrid& surface, const std::vector<Vec3>& inside,
                                              const std::vector<Vec3>& outside, double slack = 0);

/// Checks that no position is given both as inside and as outside.
/// @throws Error InvalidInput if a position inside and one outside are at most `same` (world units) apart; the message
///     contains the position.
COVOL_API void check_sides(const std::vector<Vec3>& inside, const std::vector<Vec3>& outside, double same);

}  // namespace covol
