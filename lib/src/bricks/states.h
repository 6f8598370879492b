#pragma once
// Level sets of bricks, assembled and split leaf by leaf.
#include "covol/bricks.h"

namespace covol::bricks {

/// The leaves of `u` that meet the box, with their masks; nothing else. Keeps u's transform and name.
[[nodiscard]] FloatGridPtr leaves_within(const FloatGrid& u, const VoxelBox& box);

/// Adds the leaves of `from` that meet the box, with their masks. @pre `to` has none of them
void copy_leaves(const FloatGrid& from, const VoxelBox& box, FloatGrid& to);

/// Adds the leaves that meet the box, and their active voxels, to the counts.
void count(const FloatGrid& u, const VoxelBox& box, std::int64_t& active_voxels, std::int64_t& leaves);

/// The level set on `domain` that consists of the leaves of the listed bricks' cores. Near seams it is the mean of the
/// overlapping states; the weight of a state decreases from inside its core to the end of the state.
/// @throws Error InvalidInput if a brick has no state.
[[nodiscard]] FloatGridPtr assemble(const BrickPlan& plan, const Domain& domain, const std::vector<std::size_t>& bricks,
                                    const BrickStates& states);

/// Lower and upper bounds that fix a level set in the layers at those faces of `part` beyond which `whole` continues.
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
