#include "guidance/conjugate_gradients.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

namespace covol::guidance {
namespace {

constexpr std::size_t kBlock = 1024;  // rows of a partial sum; fixed, so that results do not depend on the threads

/// Calls visit(row) for each row, and sums the return values.
template <typename Visit>
double sum_over(std::size_t rows, std::vector<double>& sums, const Visit& visit) {
    sums.resize((rows + kBlock - 1) / kBlock);
    tbb::parallel_for(std::size_t(0), sums.size(), [&](std::size_t block) {
        double sum = 0;
        for (std::size_t i = block * kBlock; i < std::min(rows, (block + 1) * kBlock); ++i) sum += visit(i);
        sums[block] = sum;
    });
    double total = 0;
    for (const double sum : sums) total += sum;
    return total;
}

/// The product of a row of a symmetric matrix and x. The row is read as a column, which is stored contiguously.
double row_times(const Eigen::SparseMatrix<double>& matrix, std::size_t row, const double* x) {
    const double* value = matrix.valuePtr();
    const int *other = matrix.innerIndexPtr(), *first = matrix.outerIndexPtr();
    double sum = 0;
    for (int n = first[row]; n < first[row + 1]; ++n) sum += value[n] * x[other[n]];
    return sum;
}

}  // namespace

SquaredMatrix::SquaredMatrix(Eigen::SparseMatrix<double> half, std::vector<double> weight)
    : half_(std::move(half)), weight_(std::move(weight)), diagonal_(weight_.size()) {
    const double* value = half_.valuePtr();
    const int *other = half_.innerIndexPtr(), *first = half_.outerIndexPtr();
    tbb::parallel_for(std::size_t(0), diagonal_.size(), [&](std::size_t row) {
        for (int n = first[row]; n < first[row + 1]; ++n) diagonal_[row] += value[n] * weight_[other[n]] * value[n];
    });
}

void SquaredMatrix::multiply_half(const std::vector<double>& x, std::vector<double>& between) const {
    between.resize(x.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, x.size(), kBlock), [&](const auto& rows) {
        for (std::size_t i = rows.begin(); i != rows.end(); ++i)
            between[i] = weight_[i] * row_times(half_, i, x.data());
    });
}

double SquaredMatrix::finish(std::size_t row, const std::vector<double>& between) const {
    return row_times(half_, row, between.data());
}

std::vector<double> SquaredMatrix::operator*(const std::vector<double>& x) const {
    std::vector<double> between, result(x.size());
    multiply_half(x, between);
    tbb::parallel_for(std::size_t(0), x.size(), [&](std::size_t i) { result[i] = finish(i, between); });
    return result;
}

void conjugate_gradients(const SquaredMatrix& matrix, const std::vector<double>& diagonal,
                         const std::vector<double>& right, double tolerance, std::vector<double>& x) {
    const std::size_t n = right.size();
    std::vector<double> residual(n), scale(n), direction(n), image(n), scaled(n), between, sums;
    const double right2 = sum_over(n, sums, [&](std::size_t i) { return right[i] * right[i]; });
    if (right2 == 0) {
        std::fill(x.begin(), x.end(), 0.0);
        return;
    }
    const double enough2 = tolerance * tolerance * right2;
    matrix.multiply_half(x, between);
    double residual2 = sum_over(n, sums, [&](std::size_t i) {
        scale[i] = 1 / (matrix.diagonal()[i] + diagonal[i]);
        residual[i] = right[i] - matrix.finish(i, between) - diagonal[i] * x[i];
        direction[i] = scale[i] * residual[i];
        return residual[i] * residual[i];
    });
    double energy = sum_over(n, sums, [&](std::size_t i) { return residual[i] * direction[i]; });
    for (std::size_t step = 0; step < 2 * n && residual2 >= enough2; ++step) {
        matrix.multiply_half(direction, between);
        const double curvature = sum_over(n, sums, [&](std::size_t i) {
            image[i] = matrix.finish(i, between) + diagonal[i] * direction[i];
            return direction[i] * image[i];
        });
        const double way = energy / curvature, before = energy;
        energy = sum_over(n, sums, [&](std::size_t i) {
            x[i] += way * direction[i];
            residual[i] -= way * image[i];
            scaled[i] = scale[i] * residual[i];
            return residual[i] * scaled[i];
        });
        const double kept = energy / before;
        residual2 = sum_over(n, sums, [&](std::size_t i) {
            direction[i] = scaled[i] + kept * direction[i];
            return residual[i] * residual[i];
        });
    }
}

}  // namespace covol::guidance
