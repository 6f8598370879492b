#include "guidance/conjugate_gradients.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace covol::guidance {
namespace {

constexpr std::size_t kBlock = 1024;  // rows whose sums are one: what makes the bits independent of the threads

/// Calls visit(row) for each row, and sums what it returns.
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

/// Of a symmetric matrix a row is a column.
double row_times(const Eigen::SparseMatrix<double>& matrix, std::size_t row, const double* x) {
    const double* value = matrix.valuePtr();
    const int *other = matrix.innerIndexPtr(), *first = matrix.outerIndexPtr();
    double sum = 0;
    for (int n = first[row]; n < first[row + 1]; ++n) sum += value[n] * x[other[n]];
    return sum;
}

}  // namespace

void conjugate_gradients(const Eigen::SparseMatrix<double>& matrix, const std::vector<double>& diagonal,
                         const std::vector<double>& right, double tolerance, std::vector<double>& x) {
    const std::size_t n = right.size();
    std::vector<double> residual(n), scale(n), direction(n), image(n), scaled(n), sums;
    const double right2 = sum_over(n, sums, [&](std::size_t i) { return right[i] * right[i]; });
    if (right2 == 0) {
        std::fill(x.begin(), x.end(), 0.0);
        return;
    }
    const double enough2 = tolerance * tolerance * right2;
    double residual2 = sum_over(n, sums, [&](std::size_t i) {
        scale[i] = 1 / (matrix.coeff(Eigen::Index(i), Eigen::Index(i)) + diagonal[i]);
        residual[i] = right[i] - row_times(matrix, i, x.data()) - diagonal[i] * x[i];
        direction[i] = scale[i] * residual[i];
        return residual[i] * residual[i];
    });
    double energy = sum_over(n, sums, [&](std::size_t i) { return residual[i] * direction[i]; });
    for (std::size_t step = 0; step < 2 * n && residual2 >= enough2; ++step) {
        const double curvature = sum_over(n, sums, [&](std::size_t i) {
            image[i] = row_times(matrix, i, direction.data()) + diagonal[i] * direction[i];
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

std::vector<double> product(const Eigen::SparseMatrix<double>& matrix, const std::vector<double>& x) {
    std::vector<double> result(x.size());
    tbb::parallel_for(std::size_t(0), x.size(), [&](std::size_t i) { result[i] = row_times(matrix, i, x.data()); });
    return result;
}

}  // namespace covol::guidance
