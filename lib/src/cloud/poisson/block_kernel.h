#pragma once
// What multigrid does on one block of nodes. "Padded" are 10^3 values: the block's own 8^3 and one node around them, of
// which those across faces count.
#include <cstddef>

namespace covol::cloud {

constexpr std::size_t kPadded = 1000;

/// Gauss-Seidel, red nodes and then black ones: (6 + screen) u - sum of neighbours = right.
/// @param screen  or null: 0
void sweep_block(float* padded, const float* right, const float* screen);

/// residual = right + sum of neighbours - (6 + screen) u.
void residual_block(const float* padded, const float* right, const float* screen, float* residual);

/// fine += the trilinear interpolation of a coarser grid's 5^3 nodes.
void prolong_block(const float* coarse, float* fine);

/// Full weighting of 9^3 nodes, the first of each axis before the block, to 4^3 coarser ones: sums of weights 1/2, 1,
/// 1/2 along each axis.
void restrict_block(const float* fine, float* coarse);

}  // namespace covol::cloud
