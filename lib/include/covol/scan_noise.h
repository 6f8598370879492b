#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/run.h"

namespace covol {

/// The thickness of the layer of points: for each point of a fixed subsample, a plane is fitted to all points within
/// `radius` of it; the thickness is the mean distance of these points from their plane. It is small compared with the
/// radius for a smooth scan without noise, and 3/8 of the radius if points fill space evenly. 0 if no point has enough
/// neighbours for a plane.
/// @throws Error InvalidOptions (radius <= 0, not finite).
[[nodiscard]] COVOL_API double measure_layer_thickness(const std::vector<Vec3>& points, double radius,
                                                       const RunContext& run = {});

/// The smallest voxel size at which the points of a scan form one thin layer. The sizes spacing * 2^(k/2), k = 4..0,
/// are tested in descending order. A size passes if the layer thickness for a radius of 2.5 voxels is at most 0.35
/// voxels. The result is the last of the first consecutive sizes that pass; if none passes, it is the largest size
/// tested. Sizes above the spacing are skipped if 2.5 voxels exceed half the second longest edge of the points' box.
struct ScanVoxelSize {
    double voxel_size = 0;
    double thickness = 0;  ///< measure_layer_thickness() for a radius of 2.5 voxels
};
[[nodiscard]] COVOL_API ScanVoxelSize choose_scan_voxel_size(const std::vector<Vec3>& points, double spacing,
                                                             const RunContext& run = {});

/// Moves each point onto the plane fitted to the points around it, with weights that decrease to 0 at `radius`; this is
/// done twice. Adjacent layers of a scan are merged in this way. The order is kept; points with fewer than eleven other
/// points within the radius do not move.
/// @throws Error InvalidOptions (radius <= 0, not finite).
[[nodiscard]] COVOL_API std::vector<Vec3> average_layers(const std::vector<Vec3>& points, double radius,
                                                         const RunContext& run = {});

}  // namespace covol
