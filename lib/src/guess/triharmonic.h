#pragma once
#include <cstddef>

namespace covol::guess {

/// sum_j a_j r_j^3 - 3 r_j (b_j . d_j), d_j = x - x_j, r_j = |d_j|: nodes as arrays.
struct TriharmonicSum {
    const double *x, *y, *z, *a, *bx, *by, *bz;
    std::size_t count;
};

inline constexpr int kTriharmonicLanes = 8;

/// At kTriharmonicLanes positions. The same bits whatever the instruction set.
void triharmonic_sum(const TriharmonicSum& sum, const double* x, const double* y, const double* z, double* out);

}  // namespace covol::guess
