#pragma once
// What multigrid does on one row of a lattice's inner nodes, along k; each pointer is at the first of them.
#include <cstddef>

namespace covol::cloud {

/// From a node to the next along i and j.
struct RowStrides {
    std::ptrdiff_t i, j;
};

/// Gauss-Seidel on every second node, from `first` (0 or 1) on: (6 + screen) u - sum of neighbours = right.
/// @param screen  or null: 0
void sweep_row(float* u, const float* right, const float* screen, RowStrides strides, std::size_t count,
               std::size_t first);

/// residual = right + sum of neighbours - (6 + screen) u.
void residual_row(const float* u, const float* right, const float* screen, RowStrides strides, std::size_t count,
                  float* residual);

/// Full weighting along i and j, of nodes of a finer lattice: out = sum of weights 1/2, 1, 1/2 along each.
void restrict_row(const float* fine, RowStrides strides, std::size_t count, float* out);

/// (1 2 1) / 4 along one axis.
void smooth_row(const float* from, std::ptrdiff_t stride, std::size_t count, float* out);

}  // namespace covol::cloud
