#pragma once
#include <Eigen/SparseCore>
#include <vector>

namespace covol::guidance {

/// The matrix half * diag(weight) * half. The product is never formed, because it has three times as many entries as
/// `half`.
class SquaredMatrix {
public:
    /// @param half    symmetric
    /// @param weight  > 0, for each row of `half`
    SquaredMatrix(Eigen::SparseMatrix<double> half, std::vector<double> weight);

    [[nodiscard]] const std::vector<double>& diagonal() const { return diagonal_; }
    /// Computes weight * half * x on all threads. @param between  the result
    void multiply_half(const std::vector<double>& x, std::vector<double>& between) const;
    /// The entry at `row` of half * between, which is the product of the whole matrix and x.
    [[nodiscard]] double finish(std::size_t row, const std::vector<double>& between) const;
    /// The whole product, on all threads.
    [[nodiscard]] std::vector<double> operator*(const std::vector<double>& x) const;

private:
    Eigen::SparseMatrix<double> half_;
    std::vector<double> weight_, diagonal_;
};

/// Solves (matrix + diagonal) x = right by conjugate gradients on all threads, preconditioned by the diagonal (M. R.
/// Hestenes and E. Stiefel 1952). The result is bitwise the same for any number of threads.
/// @param matrix     positive definite after `diagonal` is added
/// @param diagonal   >= 0
/// @param x          in: the initial value
/// @param tolerance  of the residual, relative to the right-hand side
void conjugate_gradients(const SquaredMatrix& matrix, const std::vector<double>& diagonal,
                         const std::vector<double>& right, double tolerance, std::vector<double>& x);

}  // namespace covol::guidance
