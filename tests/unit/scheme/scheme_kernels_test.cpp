#include "scheme/scheme.h"

#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "grid/leaf_band.h"
#include "support/dense_reference.h"
#include "support/shapes.h"

// Compares the kernels on one leaf, on every instruction set, with the dense reference for the same values.

using namespace covol;
using namespace covol::test;
using detail::kLeafSize;

namespace {

/// Coefficient f of the kernel belongs to the face kReferenceFace[f] of the reference.
constexpr std::array<int, 6> kReferenceFace = {1, 0, 3, 2, 5, 4};

struct Buffer {
    alignas(64) std::array<float, detail::kPaddedSize> values{};
};

/// Copies a field of 10^3 voxels into a padded buffer. The leaf is the inner 8^3 voxels.
Buffer padded_copy(const DenseField& field) {
    Buffer buffer;
    for (int i = -1; i <= 8; ++i)
        for (int j = -1; j <= 8; ++j)
            for (int k = -1; k <= 8; ++k) {
                const double value = field.at(i + 1, j + 1, k + 1);
                buffer.values[detail::padded(i, j, k)] =
                    std::isnan(value) ? detail::kUnknown : static_cast<float>(value);
            }
    return buffer;
}

std::vector<char> inner_active(const DenseField& shape, const detail::LeafMask& mask) {
    std::vector<char> active(shape.size(), 0);
    for (int n = 0; n < kLeafSize; ++n)
        active[shape.index((n >> 6) + 1, (n >> 3 & 7) + 1, (n & 7) + 1)] = detail::is_on(mask, n);
    return active;
}

detail::LeafMask every_voxel() {
    detail::LeafMask mask;
    mask.fill(~std::uint64_t(0));
    return mask;
}

struct Rows {
    alignas(64) std::array<float, 6 * kLeafSize> c{};
    float largest = 0;
};

Rows assemble_leaf(const detail::SchemeKernels& kernels, const DenseField& u, const DenseField* d, const DenseField* g,
                   const DenseOptions& o, const detail::LeafMask& mask) {
    const Buffer pu = padded_copy(u), pd = d != nullptr ? padded_copy(*d) : Buffer{},
                 pg = g != nullptr ? padded_copy(*g) : Buffer{};
    const detail::SchemeConstants constants{float(o.tau),
                                            float(o.theta),
                                            float(o.rho),
                                            float(o.tau * o.delta),
                                            float(o.epsilon * o.epsilon),
                                            float(o.edge_epsilon * o.edge_epsilon)};
    std::array<unsigned long long, 8> bits;
    std::copy(mask.begin(), mask.end(), bits.begin());
    alignas(64) std::array<detail::Fraction, 6 * kLeafSize> fractions{};
    Rows rows;
    const detail::RowFacts facts =
        kernels.assemble(pu.values.data(), d != nullptr ? pd.values.data() : nullptr,
                         g != nullptr ? pg.values.data() : nullptr, nullptr, bits.data(), constants, fractions.data());
    rows.largest = facts.largest;
    for (int f = 0; f < 6; ++f)
        for (int n = 0; n < kLeafSize; ++n)
            rows.c[f * kLeafSize + n] = float(fractions[detail::fraction_at(f, n)]) / detail::kFractionUnit;
    return rows;
}

/// The rows of the reference in the form of the kernel's: -a_pq / (1 - Σ a), and rows of zeros for inactive voxels.
std::vector<double> reference_rows(const DenseField& u, const DenseField* d, const DenseField* g, const DenseOptions& o,
                                   const detail::LeafMask& mask) {
    const DenseSystem system = assemble(u, inner_active(u, mask), {d, g}, o);
    std::vector<double> rows(6 * kLeafSize, 0.0);
    std::size_t row = 0;
    for (int n = 0; n < kLeafSize; ++n) {
        if (!detail::is_on(mask, n)) continue;
        double diagonal = 1;
        for (int q = 0; q < 6; ++q) diagonal -= system.a[6 * row + q];
        for (int face = 0; face < 6; ++face)
            rows[face * kLeafSize + n] = -system.a[6 * row + kReferenceFace[face]] / diagonal;
        ++row;
    }
    return rows;
}

DenseOptions everything_on() {
    DenseOptions o;
    o.theta = 0.8;
    o.rho = 0.6;
    o.delta = 2;
    o.tau = 1.5;
    return o;
}

}  // namespace

TEST_CASE("The mean gradient equals that of the reference") {
    const DenseField u = rounded(sample(cube_domain(10, 1.0), random_waves(11, 4.0)));
    alignas(64) std::array<float, kLeafSize> out;
    const Buffer padded = padded_copy(u);
    for (const detail::SchemeKernels* kernels : detail::available_kernels()) {
        kernels->mean_gradient(padded.values.data(), out.data());
        double worst = 0;
        for (int n = 0; n < kLeafSize; ++n) {
            double mean = 0;
            for (const Gradient& g : tetrahedron_gradients(u, (n >> 6) + 1, (n >> 3 & 7) + 1, (n & 7) + 1))
                mean += length(g) / 24;
            worst = std::max(worst, std::abs(out[n] - mean));
        }
        INFO(kernels->name);
        CHECK(worst < 1e-6);
    }
}

TEST_CASE("The rows of a leaf equal those of the reference") {
    const Domain d = cube_domain(10, 1.0);
    const DenseField u = rounded(sample(d, random_waves(12, 4.0)));
    const DenseField distance = rounded(sample(d, [](const Vec3& x) {
        return length({x[0] - 1.3, x[1], x[2] + 0.7});
    }));
    const Function waves = random_waves(13, 5.0);
    const DenseField g = rounded(sample(d, [&](const Vec3& x) { return 0.5 + 0.2 * waves(x); }));
    detail::LeafMask some = every_voxel();
    some[2] = 0x0f0f3355aa00ffffULL;
    some[7] = 0;
    const auto compare = [&](const DenseField* df, const DenseField* gf, const DenseOptions& o,
                             const detail::LeafMask& mask) {
        const std::vector<double> expected = reference_rows(u, df, gf, o, mask);
        double largest = 0;
        for (int n = 0; n < kLeafSize; ++n) {
            double sum = 0;
            for (int face = 0; face < 6; ++face) sum += expected[face * kLeafSize + n];
            largest = std::max(largest, sum / (1 - sum));
        }
        for (const detail::SchemeKernels* kernels : detail::available_kernels()) {
            const Rows rows = assemble_leaf(*kernels, u, df, gf, o, mask);
            double worst = 0, worst_sum = 0;
            for (int n = 0; n < kLeafSize; ++n) {
                double off = 0;
                for (int m = n; m < 6 * kLeafSize; m += kLeafSize) {
                    worst = std::max(worst, std::abs(rows.c[m] - expected[m]));
                    off += rows.c[m] - expected[m];
                }
                worst_sum = std::max(worst_sum, std::abs(off));
            }
            INFO(kernels->name);
            CHECK(worst < 0.5 / detail::kFractionUnit + 5e-6);
            CHECK(worst_sum < 3.0 / detail::kFractionUnit + 5e-6);
            CHECK(rows.largest == Approx(largest).epsilon(1e-5));
        }
    };
    DenseOptions o = everything_on();
    SECTION("all terms") { compare(&distance, &g, o, every_voxel()); }
    SECTION("all terms, some voxels inactive") { compare(&distance, &g, o, some); }
    SECTION("points alone") {
        o.rho = o.delta = 0;
        compare(&distance, nullptr, o, every_voxel());
    }
    SECTION("image alone") {
        o.theta = o.delta = 0;
        compare(nullptr, &g, o, every_voxel());
    }
    SECTION("curvature alone") {
        o.theta = o.rho = 0;
        compare(nullptr, nullptr, o, some);
    }
    SECTION("fields unknown in some voxels") {
        DenseField part_d = distance, part_g = g;
        for_each_voxel(d, [&](int i, int j, int k, const Vec3& x) {
            if (x[0] + x[1] > 2) part_d.at(i, j, k) = NAN;
            if (x[2] - x[1] > 2) part_g.at(i, j, k) = NAN;
        });
        compare(&part_d, &part_g, o, every_voxel());
    }
    SECTION("a constant u") {
        const DenseField flat(10, 10, 10, 1.0, -3.0);
        const double s = o.tau * o.delta;  // since M W = ε / ε = 1 for a flat u
        for (const detail::SchemeKernels* kernels : detail::available_kernels())
            for (const float c : assemble_leaf(*kernels, flat, nullptr, nullptr, o, every_voxel()).c)
                CHECK(std::abs(c - s / (1 + 6 * s)) < 0.5 / detail::kFractionUnit + 1e-6);
    }
}
