#include "guidance/conjugate_gradients.h"

#include <Eigen/SparseCholesky>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "covol/run.h"

using namespace covol;

namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// The identity plus the Laplacian of a graph, a ring with some chords. This matrix is symmetric and positive definite.
Sparse graph_matrix(int n) {
    std::mt19937_64 random(7);
    std::vector<Eigen::Triplet<double>> entries;
    const auto couple = [&](int a, int b, double weight) {
        entries.emplace_back(a, a, weight);
        entries.emplace_back(b, b, weight);
        entries.emplace_back(a, b, -weight);
        entries.emplace_back(b, a, -weight);
    };
    for (int i = 0; i < n; ++i) {
        entries.emplace_back(i, i, 1);
        couple(i, (i + 1) % n, 1 + i % 5);
        couple(i, int(random() % std::uint64_t(n - 1) + std::uint64_t(i) + 1) % n, 0.5);
    }
    Sparse half(n, n);
    half.setFromTriplets(entries.begin(), entries.end());
    return half;
}

}  // namespace

TEST_CASE("Conjugate gradients agree with a factorization and are bit-identical on any number of threads") {
    const int n = GENERATE(1, 5, 1023, 3000);
    const Sparse half = n < 3 ? Sparse(Eigen::MatrixXd::Constant(1, 1, 4.0).sparseView()) : graph_matrix(n);
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<double> weight(n), diagonal(n), right(n), begin(n);
    for (int i = 0; i < n; ++i) {
        diagonal[i] = i % 3 ? std::abs(uniform(random)) * 50 : 0;
        right[i] = uniform(random);
        begin[i] = 10 * uniform(random);
        weight[i] = 1 + 0.9 * uniform(random);
    }
    const guidance::SquaredMatrix matrix(half, weight);
    const Sparse product = half * Eigen::Map<const Eigen::VectorXd>(weight.data(), n).asDiagonal() * half;
    Sparse whole = product;
    for (int i = 0; i < n; ++i) whole.coeffRef(i, i) += diagonal[i];
    const Eigen::SimplicialLDLT<Sparse> factors(whole);
    const Eigen::VectorXd exact = factors.solve(Eigen::Map<const Eigen::VectorXd>(right.data(), n));

    const auto solve = [&](int threads) {
        RunContext run;
        run.threads = threads;
        std::vector<double> x = begin;
        with_threads(run, [&] { guidance::conjugate_gradients(matrix, diagonal, right, 1e-12, x); });
        return x;
    };
    const std::vector<double> one = solve(1);
    for (int i = 0; i < n; ++i) REQUIRE(one[i] == Approx(exact[i]).margin(1e-9));
    CHECK(solve(2) == one);
    CHECK(solve(8) == one);

    const std::vector<double> image = matrix * begin;
    const Eigen::VectorXd expected = product * Eigen::Map<const Eigen::VectorXd>(begin.data(), n);
    for (int i = 0; i < n; ++i) {
        REQUIRE(image[i] == Approx(expected[i]).margin(1e-9));
        REQUIRE(matrix.diagonal()[i] == Approx(product.coeff(i, i)).epsilon(1e-12));
    }

    std::vector<double> nothing = begin;
    guidance::conjugate_gradients(matrix, diagonal, std::vector<double>(n, 0.0), 1e-8, nothing);
    CHECK(nothing == std::vector<double>(n, 0.0));
}
