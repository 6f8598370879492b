// Compiled once for each instruction set (see lib/CMakeLists.txt). All functions of Eigen that this file instantiates
// are in the namespace COVOL_EIGEN instead of Eigen: otherwise the linker would merge them with the functions of the
// same names in other files, and a processor without AVX2 could run code that needs it.
#define Eigen COVOL_EIGEN
#include "guess/dense_kernels.h"

#include <Eigen/Cholesky>

#define COVOL_TEXT_(x) #x
#define COVOL_TEXT(x) COVOL_TEXT_(x)

namespace covol::guess::COVOL_SIMD_NAME {
namespace {

using Size = DenseKernels::Size;
using Stride = Eigen::OuterStride<>;
using Strided = Eigen::Map<Eigen::MatrixXd, 0, Stride>;
using ConstStrided = Eigen::Map<const Eigen::MatrixXd, 0, Stride>;

bool cholesky(double* matrix, Size n) {
    Eigen::Map<Eigen::MatrixXd> A(matrix, n, n);
    return Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(A).info() == Eigen::Success;
}

void solve_lower(const double* L, Size n, Size L_stride, double* B, Size B_columns, Size B_stride) {
    Strided X(B, n, B_columns, Stride(B_stride));
    ConstStrided(L, n, n, Stride(L_stride)).triangularView<Eigen::Lower>().solveInPlace(X);
}

void add_transposed_product(const double* A, Size A_stride, const double* B, Size B_stride, Size inner, double* C,
                            Size C_rows, Size C_columns, Size C_stride) {
    Strided(C, C_rows, C_columns, Stride(C_stride)).noalias() +=
        ConstStrided(A, inner, C_rows, Stride(A_stride)).transpose() *
        ConstStrided(B, inner, C_columns, Stride(B_stride));
}

void times(const double* A, Size n, const double* x, double* y) {
    Eigen::Map<Eigen::VectorXd>(y, n).noalias() =
        Eigen::Map<const Eigen::MatrixXd>(A, n, n) * Eigen::Map<const Eigen::VectorXd>(x, n);
}

}  // namespace

extern const DenseKernels kDenseKernels;
const DenseKernels kDenseKernels{COVOL_TEXT(COVOL_SIMD_NAME), cholesky, solve_lower, add_transposed_product, times};

}  // namespace covol::guess::COVOL_SIMD_NAME
