#pragma once
// Level sets of bricks, assembled and split leaf by leaf.
#include "covol/bricks.h"

namespace covol::bricks {

/// A grid that consists of the leaves of `u` that intersect the box, with their active voxels. It has the transform and
/// name of `u`, but not its tiles.
[[nodiscard]] FloatGridPtr leaves_within(const FloatGrid& u, const VoxelBox& box);

/// Copies the leaves of `from` that intersect the box, with their active voxels, to `to`. @pre `to` has none of these
/// leaves
void copy_leaves(const FloatGrid& from, const VoxelBox& box, FloatGrid& to);

/// Adds the number of leaves of `u` that intersect the box, and the number of their active voxels, to the counts.
void count(const FloatGrid& u, const VoxelBox& box, std::int64_t& active_voxels, std::int64_t& leaves);

/// The level set on `domain` that consists of the leaves of the listed bricks' cores. Near seams it is the mean of the
/// overlapping states; the weight of a state decreases from inside its core to the end of the state.
/// @throws Error InvalidInput if a brick has no state.
[[nodiscard]] FloatGridPtr assemble(const BrickPlan& plan, const Domain& domain, const std::vector<std::size_t>& bricks,
                                    const BrickStates& states);

/// Lower and upper bounds of the level set in a brick. They fix it to the start in the outermost layers of `part`,
/// which is the brick with layers of its neighbours, at the faces beyond which `whole`, the domain of all bricks,
/// continues. They do not limit it elsewhere.
struct Frame {
    FloatGridPtr floor, obstacle;
};
[[nodiscard]] Frame make_frame(const FloatGrid& start, const Domain& part, const Domain& whole);

/// The voxels of `other` within three layers of `core`.
[[nodiscard]] VoxelBox beside(const VoxelBox& core, const VoxelBox& other);

/// Maximum distance from the surface of `a` to that of `b` between the voxels of `box`, in voxels; kHalfWidthVoxels if
/// a part of a's surface lies outside b's band.
[[nodiscard]] double gap_between(const FloatGrid& a, const FloatGrid& b, const VoxelBox& box);

}  // namespace covol::bricks
