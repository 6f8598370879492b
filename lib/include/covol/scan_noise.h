#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/run.h"

namespace covol {

/// The thickness of the layer of points: the mean distance of points from the plane fitted to all points within
/// `radius` of them, over a fixed subsample. Small compared with the radius on a smooth clean scan; 3/8 of it if points
/// fill space evenly. 0 if no point has enough neighbours for a plane.
/// @throws Error InvalidOptions (radius <= 0, not finite).
[[nodiscard]] COVOL_API double measure_layer_thickness(const std::vector<Vec3>& points, double radius,
                                                       const RunContext& run = {});

/// The voxel size that a scan supports, and how it was found. Of the sizes spacing * 2^(k/2), k = 0..5, from the
/// largest downwards, it is the last in the first sequence of sizes at which points are on average within 0.35 voxels
/// of the plane through the points within 2.5 voxels of them. If larger sizes fail this because the surface itself
/// bends, the sequence begins at 0.25 voxels, which noise never satisfies. Only sizes whose 2.5 voxels are at most half
/// the second longest edge of the points' box are considered, because beyond that a plane fits the whole shape. If none
/// passes, it is the largest considered.
struct ScanVoxelSize {
    double voxel_size = 0;
    double thickness = 0;  ///< measure_layer_thickness() at it
};
[[nodiscard]] COVOL_API ScanVoxelSize choose_scan_voxel_size(const std::vector<Vec3>& points, double spacing,
                                                             const RunContext& run = {});

/// Moves each point along the normal onto the plane fitted, with weights that decrease to 0 at `radius`, to the points
/// around it; twice. Adjacent layers of one scan are merged. The order is kept; points with fewer than eleven others
/// around them do not move.
/// @throws Error InvalidOptions (radius <= 0, not finite).
[[nodiscard]] COVOL_API std::vector<Vec3> average_layers(const std::vector<Vec3>& points, double radius,
                                                         const RunContext& run = {});

}  // namespace covol
