#pragma once
#include <functional>
#include <vector>

#include "covol/api.h"
#include "covol/contours.h"
#include "covol/domain.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/run.h"

namespace covol {

// Starts other than tagging. The result is u0 = clamp(signed distance, -3h, 3h), h the voxel size, active where |u0| <
// 3h, named "band".
// All functions throw Error InvalidOptions / InvalidInput if no surface lies in the domain.
[[nodiscard]] COVOL_API FloatGridPtr start_from_sphere(const Domain& domain, const Vec3& center, double radius);
[[nodiscard]] COVOL_API FloatGridPtr start_from_box(const Domain& domain, const WorldBox& box);
[[nodiscard]] COVOL_API FloatGridPtr start_from_mesh(const Domain& domain, const TriangleMesh& mesh,
                                                     const RunContext& run = {});
/// Voxels of the mask above 0 are inside.
[[nodiscard]] COVOL_API FloatGridPtr start_from_mask(const Domain& domain, const Image& mask,
                                                     const RunContext& run = {});
/// The body between closed contours; see ContourSolid.
[[nodiscard]] COVOL_API FloatGridPtr start_from_contours(const Domain& domain, const ContourSolid& solid,
                                                         const RunContext& run = {});
/// Computes a function, negative inside, at the world positions from + n * step, 0 <= n < count.
using LevelRow = std::function<void(const Vec3& from, const Vec3& step, int count, double* values)>;
/// The parts of the zero level set of `level` that pass near the seeds. Only the zeros of `level` matter, not its
/// scale.
[[nodiscard]] COVOL_API FloatGridPtr start_from_level(const Domain& domain, const std::vector<Vec3>& seeds,
                                                      const LevelRow& level, const RunContext& run = {});
/// A surface from seeds alone: halfway between the nearest seeds inside and outside, but within a maximum distance of
/// the seeds inside. That distance is half the median distance from a seed outside to the nearest seed inside, or
/// kHalfWidthVoxels voxels without seeds outside, and is increased if it is too small to join the seeds inside.
/// @throws Error also if there is no seed inside, or none in the domain.
[[nodiscard]] COVOL_API FloatGridPtr start_from_seeds(const Domain& domain, const std::vector<Vec3>& inside,
                                                      const std::vector<Vec3>& outside, const RunContext& run = {});
/// The zero level set of any grid that is negative inside, resampled onto the domain.
[[nodiscard]] COVOL_API FloatGridPtr start_from_grid(const Domain& domain, const FloatGrid& level_set,
                                                     const RunContext& run = {});

}  // namespace covol
