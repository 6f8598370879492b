#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/run.h"

namespace covol {

/// How thick the layer of points is: the mean distance of points to the plane fitted to all within `radius` of them,
/// over a fixed subsample. Small against the radius on a smooth clean scan; 3/8 of it where points fill space evenly.
/// 0 where no point has enough neighbours for a plane.
/// @throws Error InvalidOptions (radius <= 0, not finite).
[[nodiscard]] COVOL_API double measure_layer_thickness(const std::vector<Vec3>& points, double radius,
                                                       const RunContext& run = {});

/// The voxel size that a scan supports, and how it was found: the smallest of spacing * 1.25^k, k = 0..7, from which
/// on, up to some larger one, points lie within 0.35 voxels, on the mean, of the plane through what is within 2.5
/// voxels of them. Larger ones may fail where smaller ones hold with a quarter of a voxel, which noise never does:
/// there the surface itself bends. Only those count whose 2.5 voxels are at most half the second longest edge of the
/// points' box: beyond, a plane goes through the whole shape. Where none holds, the largest that counts.
struct ScanVoxelSize {
    double voxel_size = 0;
    double thickness = 0;  ///< measure_layer_thickness() at it
};
[[nodiscard]] COVOL_API ScanVoxelSize choose_scan_voxel_size(const std::vector<Vec3>& points, double spacing,
                                                             const RunContext& run = {});

/// Each point moved along the normal onto the plane fitted, with weights that fall to 0 at `radius`, to the points
/// around it; twice. Layers of one scan that lie beside each other become one. The order stays; points with fewer than
/// six others around them stay where they are.
/// @throws Error InvalidOptions (radius <= 0, not finite).
[[nodiscard]] COVOL_API std::vector<Vec3> average_layers(const std::vector<Vec3>& points, double radius,
                                                         const RunContext& run = {});

}  // namespace covol
