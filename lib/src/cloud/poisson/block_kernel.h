#pragma once
// Multigrid operations on one block of nodes. A padded block has 10^3 values: the block's own 8^3 and one layer of
// nodes around them, of which only those across faces are used.
#include <cstddef>

namespace covol::cloud {

constexpr std::size_t kPadded = 1000;

/// Performs a red-black Gauss-Seidel sweep for the equation (6 + screen) u - sum of the six neighbours of u = right.
/// @param padded  u, in a padded block
/// @param right, screen  8^3 values each; screen may be null, which is 0 at all nodes
void sweep_block(float* padded, const float* right, const float* screen);

/// Computes the residual of the equation of sweep_block(): right + sum of the six neighbours of u - (6 + screen) u.
void residual_block(const float* padded, const float* right, const float* screen, float* residual);

/// Adds to a block of 8^3 nodes the trilinear interpolation of the 5^3 nodes of the coarser grid that surround them.
void prolong_block(const float* coarse, float* fine);

/// Restricts 9^3 nodes, which begin one node before the block along each axis, to 4^3 nodes of the coarser grid by sums
/// with the weights 1/2, 1, 1/2 along each axis.
void restrict_block(const float* fine, float* coarse);

}  // namespace covol::cloud
