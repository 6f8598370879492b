#pragma once
// Level sets of bricks, assembled and split leaf by leaf.
#include "covol/bricks.h"

namespace covol::bricks {

/// The leaves of `u` that meet the box, with their masks; nothing else. Keeps u's transform and name.
[[nodiscard]] FloatGridPtr leaves_within(const FloatGrid& u, const VoxelBox& box);

/// Adds the leaves of `from` that meet the box, with their masks. @pre `to` has none of them
void copy_leaves(const FloatGrid& from, const VoxelBox& box, FloatGrid& to);

/// Adds the active voxels and leaves in the box to the counts.
void count(const FloatGrid& u, const VoxelBox& box, std::int64_t& active_voxels, std::int64_t& leaves);

/// A level set on `domain`: from each brick in the list the leaves of its core, limited by the domain. Near seams the
/// states are blended, weighted by how deep in its core, or how far beyond it, a voxel lies.
/// @throws Error InvalidInput if a brick has no state.
[[nodiscard]] FloatGridPtr assemble(const BrickPlan& plan, const Domain& domain, const std::vector<std::size_t>& bricks,
                                    const BrickStates& states);

/// Bounds that fix a level set at the faces where its part ends but the whole continues, and nowhere else.
struct Frame {
    FloatGridPtr floor, obstacle;
};
[[nodiscard]] Frame make_frame(const FloatGrid& start, const Domain& part, const Domain& whole);

/// The voxels of `other` that lie next to those of `core`.
[[nodiscard]] VoxelBox beside(const VoxelBox& core, const VoxelBox& other);

/// Maximum distance from the surface of `a` to that of `b` between the voxels of `box`, in voxels; kHalfWidthVoxels if
/// it is not within b's band.
[[nodiscard]] double gap_between(const FloatGrid& a, const FloatGrid& b, const VoxelBox& box);

}  // namespace covol::bricks
