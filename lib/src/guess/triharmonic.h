#pragma once
#include <cstddef>

namespace covol::guess {

/// The terms of sum_j (a_j r_j^3 - 3 r_j b_j . d_j) with d_j = x - x_j and r_j = |d_j|: the nodes x_j and their weights
/// a_j and b_j, as a structure of arrays.
struct TriharmonicSum {
    const double *x, *y, *z, *a, *bx, *by, *bz;
    std::size_t count;
};

inline constexpr int kTriharmonicLanes = 8;

/// Computes the sum at kTriharmonicLanes positions. The result is bitwise the same for all instruction sets.
void triharmonic_sum(const TriharmonicSum& sum, const double* x, const double* y, const double* z, double* out);

}  // namespace covol::guess
