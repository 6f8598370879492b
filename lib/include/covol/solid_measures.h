#pragma once
#include "covol/api.h"
#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/run.h"

namespace covol {

/// Where a solid lies and how far it reaches; world units.
struct SolidMeasures {
    Vec3 centroid{0, 0, 0};  ///< of the inside
    WorldBox box;            ///< the smallest box along the world's axes that holds the surface
};

/// A voxel counts by the share of it that a plane at its distance leaves inside; the box ends where the distance is 0
/// between voxels, so that both are far more precise than a voxel. The same bits on any number of threads.
/// @param surface  a signed distance, negative inside, on cubic voxels along the world's axes
/// @throws Error InvalidInput where nothing is inside, Cancelled.
[[nodiscard]] COVOL_API SolidMeasures measure_solid(const FloatGrid& surface, const RunContext& run = {});

/// How near to a ball a closed surface is: the area of the ball of this volume over its own; 1 for a ball (Wadell
/// 1935). 0 where there is no area.
[[nodiscard]] COVOL_API double sphericity(double volume, double area);

}  // namespace covol
