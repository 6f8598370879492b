#pragma once
// Multigrid operations on one block of nodes. "Padded" stands for 10^3 values: the block's own 8^3 and one layer of
// nodes around them, of which only those across faces are used.
#include <cstddef>

namespace covol::cloud {

constexpr std::size_t kPadded = 1000;

/// Red-black Gauss-Seidel sweep for (6 + screen) u - sum of neighbours = right.
/// @param screen  null: 0
void sweep_block(float* padded, const float* right, const float* screen);

/// residual = right + sum of neighbours - (6 + screen) u.
void residual_block(const float* padded, const float* right, const float* screen, float* residual);

/// Adds the trilinear interpolation of 5^3 nodes of the coarser grid.
void prolong_block(const float* coarse, float* fine);

/// Full weighting of 9^3 nodes, the first along each axis before the block, to 4^3 coarser nodes: weighted sums with
/// 1/2, 1, 1/2 along each axis.
void restrict_block(const float* fine, float* coarse);

}  // namespace covol::cloud
