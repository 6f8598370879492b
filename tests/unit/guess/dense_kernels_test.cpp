#include "guess/dense_kernels.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>

namespace covol::guess {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr Index kSize = 150;  // more than the blocks into which Eigen divides matrices

/// A matrix whose elements do not depend on the C library's random numbers.
MatrixXd some_matrix(Index rows, Index columns) {
    MatrixXd m(rows, columns);
    for (Index i = 0; i < rows; ++i)
        for (Index j = 0; j < columns; ++j) m(i, j) = std::sin(1.0 + double(37 * i + 101 * j + i * j % 11));
    return m;
}

/// The product by its definition.
MatrixXd product(const MatrixXd& a, const MatrixXd& b) {
    MatrixXd c = MatrixXd::Zero(a.rows(), b.cols());
    for (Index i = 0; i < c.rows(); ++i)
        for (Index j = 0; j < c.cols(); ++j)
            for (Index k = 0; k < a.cols(); ++k) c(i, j) += a(i, k) * b(k, j);
    return c;
}

double difference(const MatrixXd& a, const MatrixXd& b) { return (a - b).cwiseAbs().maxCoeff(); }

MatrixXd lower(const MatrixXd& m) { return m.triangularView<Eigen::Lower>(); }

TEST_CASE("Dense kernels: the product of the Cholesky factor and its transpose is the matrix") {
    for (const DenseKernels* const set : available_dense_kernels()) {
        const DenseKernels& dense = *set;
        INFO(dense.name);
        const MatrixXd m = some_matrix(kSize, kSize);
        const MatrixXd positive = product(m.transpose(), m) + MatrixXd::Identity(kSize, kSize);
        MatrixXd factor = positive;
        REQUIRE(dense.cholesky(factor.data(), kSize));
        const MatrixXd L = lower(factor);
        CHECK(difference(product(L, L.transpose()), positive) < 1e-11 * positive.norm());
        MatrixXd indefinite = positive;
        indefinite(kSize - 1, kSize - 1) = -1;
        CHECK_FALSE(dense.cholesky(indefinite.data(), kSize));
    }
}

TEST_CASE("Dense kernels: a triangular system in blocks of larger matrices is solved in place") {
    for (const DenseKernels* const set : available_dense_kernels()) {
        const DenseKernels& dense = *set;
        INFO(dense.name);
        const Index n = kSize - 20, columns = 70;
        MatrixXd whole = some_matrix(kSize, kSize);
        whole.diagonal().array() += 20.0;
        MatrixXd right = some_matrix(kSize, columns);
        const MatrixXd before = right;
        dense.solve_lower(&whole(20, 20), n, kSize, &right(20, 0), columns, kSize);
        CHECK(difference(product(lower(whole.bottomRightCorner(n, n)), right.bottomRows(n)), before.bottomRows(n)) <
              1e-11);
        CHECK(difference(right.topRows(20), before.topRows(20)) == 0);
    }
}

TEST_CASE("Dense kernels: products are those of the definition, also in blocks of larger matrices") {
    for (const DenseKernels* const set : available_dense_kernels()) {
        const DenseKernels& dense = *set;
        INFO(dense.name);
        const MatrixXd a = some_matrix(kSize, kSize), b = some_matrix(kSize, 64);
        MatrixXd c = MatrixXd::Constant(kSize, 64, 7.0);
        const Index n = kSize - 30;
        dense.add_transposed_product(&a(30, 10), kSize, &b(30, 4), kSize, n, &c(50, 1), 90, 33, kSize);
        const MatrixXd sum = product(a.block(30, 10, n, 90).transpose(), b.block(30, 4, n, 33)).array() + 7.0;
        CHECK(difference(c.block(50, 1, 90, 33), sum) < 1e-12);
        c.block(50, 1, 90, 33).setConstant(7.0);
        CHECK(difference(c, MatrixXd::Constant(kSize, 64, 7.0)) == 0);

        const MatrixXd x = some_matrix(kSize, 1);
        MatrixXd y = x;
        dense.times(a.data(), kSize, x.data(), y.data());
        CHECK(difference(y, product(a, x)) < 1e-12);
    }
}

}  // namespace
}  // namespace covol::guess
