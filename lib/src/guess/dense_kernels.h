#pragma once
// Dense linear algebra for systems of hundreds of marks: Eigen's, compiled once for each instruction set.
#include <cstddef>
#include <vector>

namespace covol::guess {

/// Matrices are stored by columns; `stride` is the distance between the first elements of successive columns. The
/// results of the instruction sets differ by rounding.
struct DenseKernels {
    const char* name;  ///< "baseline" or "avx2"

    using Size = std::ptrdiff_t;

    /// Replaces the lower triangle of an n x n matrix by its Cholesky factor L.
    /// @return false if the matrix is not positive definite
    bool (*cholesky)(double* matrix, Size n);

    /// Solves L X = B for a lower triangular n x n matrix L. B, which has n rows, is replaced by X.
    void (*solve_lower)(const double* L, Size n, Size L_stride, double* B, Size B_columns, Size B_stride);

    /// Adds A^T B to C. A and B have `inner` rows; A has as many columns as C has rows.
    void (*add_transposed_product)(const double* A, Size A_stride, const double* B, Size B_stride, Size inner,
                                   double* C, Size C_rows, Size C_columns, Size C_stride);

    /// y = A x for an n x n matrix A whose columns follow each other.
    void (*times)(const double* A, Size n, const double* x, double* y);
};

/// The kernels of the instruction set that the solver uses, too (scheme/scheme.h); those for AVX2 if it uses AVX-512.
[[nodiscard]] const DenseKernels& dense_kernels();

/// All kernels that this processor supports.
[[nodiscard]] std::vector<const DenseKernels*> available_dense_kernels();

}  // namespace covol::guess
