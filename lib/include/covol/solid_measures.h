#pragma once
#include "covol/api.h"
#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/run.h"

namespace covol {

/// Position and extent of a solid; world units.
struct SolidMeasures {
    Vec3 centroid{0, 0, 0};  ///< centroid of the solid's volume
    WorldBox box;            ///< the smallest box along the world's axes that contains the surface
};

/// Measures a solid. Each voxel is weighted by the fraction that is inside, with the surface in it approximated by a
/// plane at the stored distance; the box ends at the interpolated zero crossings between voxels. Centroid and box are
/// therefore much more precise than a voxel. Bit-identical for any number of threads.
/// @param surface  a signed distance, negative inside, on cubic voxels along the world's axes
/// @throws Error InvalidInput if nothing is inside, Cancelled.
[[nodiscard]] COVOL_API SolidMeasures measure_solid(const FloatGrid& surface, const RunContext& run = {});

/// The sphericity of a closed surface (Wadell 1935): the area of the sphere with the same volume divided by the
/// surface's area; 1 for a sphere, 0 if the area is 0.
[[nodiscard]] COVOL_API double sphericity(double volume, double area);

}  // namespace covol
