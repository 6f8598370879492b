#pragma once
#include <Eigen/SparseCore>
#include <vector>

namespace covol::guidance {

/// Solves (matrix + diagonal) x = right by conjugate gradients on all threads, scaled by its diagonal (M. R. Hestenes
/// and E. Stiefel 1952). The same bits for any number of threads.
/// @param matrix     symmetric, positive definite with the diagonal
/// @param diagonal   >= 0
/// @param x          in: where to begin
/// @param tolerance  of the residual, relative to the right-hand side
void conjugate_gradients(const Eigen::SparseMatrix<double>& matrix, const std::vector<double>& diagonal,
                         const std::vector<double>& right, double tolerance, std::vector<double>& x);

/// matrix * x, on all threads, of a symmetric matrix.
[[nodiscard]] std::vector<double> product(const Eigen::SparseMatrix<double>& matrix, const std::vector<double>& x);

}  // namespace covol::guidance
