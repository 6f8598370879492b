#pragma once
#include "covol/api.h"
#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/run.h"

namespace covol {

/// Position and extent of a solid; world units.
struct SolidMeasures {
    Vec3 centroid{0, 0, 0};  ///< of the inside
    WorldBox box;            ///< the smallest box along the world's axes that holds the surface
};

/// A voxel contributes the fraction of it that is inside of a plane at its distance; the box ends where the distance is
/// 0 between voxels. Both are therefore far more precise than a voxel. Bit-identical for any number of threads.
/// @param surface  a signed distance, negative inside, on cubic voxels along the world's axes
/// @throws Error InvalidInput if nothing is inside, Cancelled.
[[nodiscard]] COVOL_API SolidMeasures measure_solid(const FloatGrid& surface, const RunContext& run = {});

/// How close a closed surface is to a sphere: the area of the sphere of this volume divided by its own; 1 for a sphere
/// (Wadell 1935). 0 if there is no area.
[[nodiscard]] COVOL_API double sphericity(double volume, double area);

}  // namespace covol
