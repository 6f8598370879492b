// Compares the vectorised kernels with the formulas of the scheme, implemented plainly in double precision.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "scheme/scheme.h"

using namespace covol::detail;

namespace {

using Padded = std::vector<float>;

Padded fill(const std::function<double(int, int, int)>& f) {
    Padded values(kPaddedSize, 0.0F);
    for (int i = -1; i <= 8; ++i)
        for (int j = -1; j <= 8; ++j)
            for (int k = -1; k <= 8; ++k) values[padded(i, j, k)] = static_cast<float>(f(i, j, k));
    return values;
}

Padded random_field(unsigned seed, double low, double high) {
    std::mt19937 engine(seed);
    return fill([&](int, int, int) { return low + (high - low) * (engine() / 4294967296.0); });
}

constexpr int kSteps[6][3] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};

struct Rows {
    std::array<double, 6> c{};
    double sum = 0.0;
};

// The row of voxel (i,j,l) by definition: from the four tetrahedra of each face, whose corners are the centres of this
// voxel and of its neighbour across the face, and two vertices of the face.
Rows plain_row(const Padded& u, const Padded* phi, const Padded* g, const SchemeConstants& k, int i, int j, int l) {
    const auto at = [](const Padded& f, int a, int b, int c) { return double(f[padded(a, b, c)]); };
    // The value at the voxel's vertex in the direction (si, sj, sk), each +-1: the mean of the eight voxels around it.
    const auto vertex = [&](int si, int sj, int sk) {
        double sum = 0.0;
        for (int a = 0; a < 2; ++a)
            for (int b = 0; b < 2; ++b)
                for (int c = 0; c < 2; ++c) sum += at(u, i + a * si, j + b * sj, l + c * sk);
        return sum / 8.0;
    };
    std::array<double, 6> weight{};
    double norms = 0.0;
    for (int f = 0; f < 6; ++f) {
        const int axis = f / 2, sign = f % 2 == 0 ? -1 : 1, e1 = (axis + 1) % 3, e2 = (axis + 2) % 3;
        const double p = at(u, i, j, l), q = at(u, i + kSteps[f][0], j + kSteps[f][1], l + kSteps[f][2]);
        for (int t = 0; t < 4; ++t) {
            // Edge t of the face runs along the axis `along`; it lies at the side s of the face along the axis
            // `beside`.
            const int along = t < 2 ? e1 : e2, beside = t < 2 ? e2 : e1, s = t % 2 == 0 ? -1 : 1;
            int corner[3] = {0, 0, 0};
            corner[axis] = sign, corner[beside] = s;
            corner[along] = -1;
            const double a = vertex(corner[0], corner[1], corner[2]);
            corner[along] = 1;
            const double b = vertex(corner[0], corner[1], corner[2]);
            const double n2 = (q - p) * (q - p) + (b - a) * (b - a) + (a + b - p - q) * (a + b - p - q);
            weight[f] += 0.25 / std::sqrt(k.epsilon2 + n2);
            norms += std::sqrt(n2);
        }
    }
    const double m = std::sqrt(k.epsilon2 + norms / 24.0 * (norms / 24.0));
    double edge2 = 0.0;
    const auto difference = [&](const Padded& field, int f) {
        return at(field, i + kSteps[f][0], j + kSteps[f][1], l + kSteps[f][2]) - at(field, i, j, l);
    };
    if (g != nullptr)
        for (int f = 0; f < 6; ++f) edge2 += 0.5 * difference(*g, f) * difference(*g, f);
    Rows row;
    for (int f = 0; f < 6; ++f) {
        double v = 0.0;
        if (phi != nullptr) v -= k.theta * difference(*phi, f);
        if (g != nullptr) v -= k.rho * difference(*g, f) / std::sqrt(k.edge_epsilon2 + edge2);
        row.c[f] = -(k.tau * std::min(v, 0.0) - k.curvature * m * weight[f]);
        row.sum += row.c[f];
    }
    for (double& c : row.c) c /= 1.0 + row.sum;
    return row;
}

/// The rows of a leaf as the kernel stores them, as integers in units of 1 / kFractionUnit.
struct LeafRows {
    std::vector<Fraction> fractions = std::vector<Fraction>(6 * 512);
    [[nodiscard]] double operator()(int f, int n) const { return double(fractions[fraction_at(f, n)]) / kFractionUnit; }
    [[nodiscard]] Fraction* data() { return fractions.data(); }
};

constexpr std::array<unsigned long long, 8> kAllActive = {~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL, ~0ULL};
const SchemeConstants kConstants{1.0F, 0.9F, 0.7F, 5.0F, 1e-4F, 1e-4F};

}  // namespace

TEST_CASE("Coefficients equal those of the scheme, on every instruction set") {
    const Padded u = random_field(1, -3, 3), phi = random_field(2, 0, 6), g = random_field(3, 0.1, 1);
    for (const SchemeKernels* set : available_kernels()) {
        INFO(set->name);
        LeafRows c;
        const float largest =
            set->assemble(u.data(), phi.data(), g.data(), nullptr, kAllActive.data(), kConstants, c.data()).largest;
        double worst = 0.0, largest_plain = 0.0;
        for (int n = 0; n < 512; ++n) {
            const Rows row = plain_row(u, &phi, &g, kConstants, n >> 6, n >> 3 & 7, n & 7);
            largest_plain = std::max(largest_plain, row.sum);
            for (int f = 0; f < 6; ++f) worst = std::max(worst, std::abs(row.c[f] - c(f, n)));
        }
        CHECK(worst < 0.5 / kFractionUnit + 2e-6);
        CHECK(largest == Approx(largest_plain).epsilon(1e-5));
    }
}

TEST_CASE("Coefficients are not negative, and each row sums to less than one") {
    const Padded u = random_field(4, -3, 3), phi = random_field(5, 0, 6), g = random_field(6, 0.1, 1);
    for (const SchemeKernels* set : available_kernels())
        for (const float tau : {1e-3F, 1.0F, 100.0F}) {
            SchemeConstants constants = kConstants;
            constants.tau = tau, constants.curvature = 5.0F * tau;
            LeafRows c;
            set->assemble(u.data(), phi.data(), g.data(), nullptr, kAllActive.data(), constants, c.data());
            for (int n = 0; n < 512; ++n) {
                double sum = 0.0;
                for (int f = 0; f < 6; ++f) {
                    REQUIRE(c(f, n) >= 0.0);
                    sum += c(f, n);
                }
                REQUIRE(sum < 1.0);
            }
        }
}

TEST_CASE("The mean gradient of a linear function is exact") {
    const Padded u = fill([](int i, int j, int k) { return 0.3 * i - 0.2 * j + 0.6 * k + 1.0; });
    for (const SchemeKernels* set : available_kernels()) {
        std::vector<float> slope(512);
        set->mean_gradient(u.data(), slope.data());
        for (const float s : slope) REQUIRE(s == Approx(0.7).epsilon(1e-5));
    }
}

TEST_CASE("The attraction to points is zero at voxels with unknown distance") {
    const Padded u = fill([](int i, int, int) { return i; });
    Padded phi = fill([](int i, int, int) { return 8.0 - i; });
    for (int j = -1; j <= 8; ++j)
        for (int k = -1; k <= 8; ++k) phi[padded(4, j, k)] = kUnknown;
    SchemeConstants constants = kConstants;
    constants.curvature = 0.0F;
    LeafRows c;
    for (const SchemeKernels* set : available_kernels()) {
        set->assemble(u.data(), phi.data(), nullptr, nullptr, kAllActive.data(), constants, c.data());
        const auto at = [&](int face, int i) { return c(face, (i * 8 + 3) * 8 + 3); };
        CHECK(at(kMinusI, 2) > 0.4F);  // the flow comes from -i
        for (int f = 0; f < 6; ++f) CHECK(at(f, 4) == 0.0F);
        CHECK(at(kMinusI, 5) == 0.0F);
        CHECK(at(kMinusI, 6) > 0.4F);
    }
}

TEST_CASE("Inactive voxels and closed faces have zero coefficients") {
    const Padded u = random_field(7, -3, 3);
    std::array<unsigned long long, 8> active = kAllActive;
    active[2] = 0xff00ff00ff00ff00ULL;
    const int lo[3] = {0, -5, -5}, hi[3] = {100, 6, 100};
    LeafRows open, closed;
    kernels().assemble(u.data(), nullptr, nullptr, nullptr, active.data(), kConstants, open.data());
    closed = open;
    close_faces(closed.data(), lo, hi);
    for (int n = 0; n < 512; ++n) {
        const int i = n >> 6, j = n >> 3 & 7;
        const bool on = active[i] >> (n & 63) & 1;
        double sum_open = 0.0, sum_closed = 0.0, kept = 0.0;
        for (int f = 0; f < 6; ++f) {
            const bool is_closed = (i == 0 && f == kMinusI) || (j == 6 && f == kPlusJ) || j > 6;
            sum_open += open(f, n);
            sum_closed += closed(f, n);
            if (!is_closed) kept += open(f, n);
            if (is_closed || !on) REQUIRE(closed(f, n) == 0.0F);
        }
        // The kernel divides the coefficients of a row, whose sum is S, by 1 + S. The sum of the quotients c then gives
        // S = Σc / (1 - Σc). Before the division, closing faces does not change the coefficients of the other faces.
        if (on && j <= 6)
            REQUIRE(sum_closed / (1 - sum_closed) == Approx(kept / (1 - sum_open)).epsilon(1e-3).margin(1e-6));
    }
}

namespace {

/// A padded buffer as seven blocks: the leaf, and its six neighbours, which hold only those values of the halo that are
/// read.
struct Blocks {
    std::array<std::vector<float>, 7> values;
    explicit Blocks(const Padded& from) {
        for (int n = 0; n < 7; ++n) {
            values[n].assign(512, -1e30F);  // the values at other positions must not be read
            const int step[3] = {n < 6 ? kSteps[n][0] : 0, n < 6 ? kSteps[n][1] : 0, n < 6 ? kSteps[n][2] : 0};
            for (int p = 0; p < 512; ++p) {
                const int at[3] = {(p >> 6) + 8 * step[0], (p >> 3 & 7) + 8 * step[1], (p & 7) + 8 * step[2]};
                if (std::all_of(at, at + 3, [](int a) { return a >= -1 && a <= 8; }))
                    values[n][p] = from[padded(at[0], at[1], at[2])];
            }
        }
    }
    LeafStar star() {
        LeafStar s{values[6].data(), {}};
        for (int face = 0; face < 6; ++face) s.across[face] = values[face].data();
        return s;
    }
    void copy_to(Padded& out) const {
        for (int p = 0; p < 512; ++p) out[padded(p >> 6, p >> 3 & 7, p & 7)] = values[6][p];
    }
};

}  // namespace

TEST_CASE("Beyond the domain, a padded leaf has the values at the domain's end, corners included") {
    std::vector<float> before(kPaddedSize);
    for (std::size_t n = 0; n < before.size(); ++n) before[n] = float(n);
    const std::array<std::array<int, 2>, 5> ends{{{-9, 99}, {0, 99}, {-9, 7}, {0, 7}, {3, 5}}};
    for (const auto& x : ends)
        for (const auto& y : ends)
            for (const auto& z : ends) {
                const int lo[3] = {x[0], y[0], z[0]}, hi[3] = {x[1], y[1], z[1]};
                std::vector<float> values = before;
                mirror_outside(values.data(), lo, hi);
                int wrong = 0;
                for (int i = -1; i <= 8; ++i)
                    for (int j = -1; j <= 8; ++j)
                        for (int k = -1; k <= 8; ++k) {
                            const int from = padded(std::clamp(i, lo[0], hi[0]), std::clamp(j, lo[1], hi[1]),
                                                    std::clamp(k, lo[2], hi[2]));
                            wrong += values[std::size_t(padded(i, j, k))] == before[std::size_t(from)] ? 0 : 1;
                        }
                CHECK(wrong == 0);
            }
}

TEST_CASE("Relaxation converges to the solution of the linear system") {
    const Padded u = random_field(8, -3, 3);
    for (const SchemeKernels* set : available_kernels()) {
        LeafRows c;
        std::vector<float> b(512);
        set->assemble(u.data(), nullptr, nullptr, nullptr, kAllActive.data(), kConstants, c.data());
        for (int n = 0; n < 512; ++n) b[n] = u[padded(n >> 6, n >> 3 & 7, n & 7)];
        Blocks blocks(u);
        const double first = set->relax(blocks.star(), b.data(), c.data(), kAllActive.data(), 1.5F, 2, {});
        double last = first;
        for (int sweep = 0; sweep < 100; ++sweep)
            last = set->relax(blocks.star(), b.data(), c.data(), kAllActive.data(), 1.5F, 2, {});
        Padded x = u;
        blocks.copy_to(x);
        CHECK(last < 1e-10 * first);
        double worst = 0.0;
        for (int n = 0; n < 512; ++n) {
            const int i = n >> 6, j = n >> 3 & 7, k = n & 7;
            double value = b[n];
            for (int f = 0; f < 6; ++f)
                value += c(f, n) * (double(x[padded(i + kSteps[f][0], j + kSteps[f][1], k + kSteps[f][2])]) - b[n]);
            worst = std::max(worst, std::abs(value - x[padded(i, j, k)]));
        }
        CHECK(worst < 1e-5);
    }
}

TEST_CASE("Assembly returns the residual at the previous values") {
    const Padded u = random_field(9, -3, 3);
    std::array<unsigned long long, 8> active = kAllActive;
    active[3] = 0x00ff12ff00ff34ffULL;
    for (const SchemeKernels* set : available_kernels()) {
        LeafRows c;
        const double reported =
            set->assemble(u.data(), nullptr, nullptr, nullptr, active.data(), kConstants, c.data()).residual;
        double squares = 0.0;
        for (int n = 0; n < 512; ++n) {
            if ((active[n >> 6] >> (n & 63) & 1) == 0) continue;
            const int i = n >> 6, j = n >> 3 & 7, k = n & 7;
            double row_residual = 0.0;
            for (int f = 0; f < 6; ++f)
                row_residual += c(f, n) * (double(u[padded(i + kSteps[f][0], j + kSteps[f][1], k + kSteps[f][2])]) -
                                           u[padded(i, j, k)]);
            squares += row_residual * row_residual;
        }
        CHECK(reported == Approx(squares).epsilon(1e-3));
    }
}

TEST_CASE("The mean of a wave's six neighbours is the wave times its exact eigenvalue") {
    // cos(q i) is an eigenvector of the six neighbours' mean with eigenvalue (4 + 2 cos q) / 6.
    const double q = 0.7, mean = (4 + 2 * std::cos(q)) / 6;
    const Padded wave = fill([q](int i, int, int) { return std::cos(q * i); });
    for (const SchemeKernels* set : available_kernels()) {
        std::vector<float> image(512), out(512);
        for (int n = 0; n < 512; ++n) image[n] = float(n % 7), out[n] = float(n % 5);
        Blocks blocks(wave);
        set->mean_step(blocks.star(), image.data(), 0.25F, 1.0F / 3, out.data());
        for (int n = 0; n < 512; ++n)
            CHECK(out[n] == Approx(0.25 * (n % 7) + 2 * mean * std::cos(q * (n >> 6)) - n % 5).margin(2e-6));
    }
}

TEST_CASE("Eikonal kernel: the distance to a plane is exact for every direction") {
    // The distance to a plane is linear, so its differences are exact, whether the front arrives along one, two or
    // three axes.
    const std::array<double, 3> normals[] = {{1, 0, 0},
                                             {0, -1, 0},
                                             {0, 0, 1},
                                             {0.6, 0.8, 0},
                                             {0.8, 0, -0.6},
                                             {0, 0.28, 0.96},
                                             {2. / 3, 1. / 3, 2. / 3},
                                             {-1. / 3, 2. / 3, -2. / 3}};
    for (const SchemeKernels* set : available_kernels())
        for (const auto& n : normals) {
            const auto plane = [&](int i, int j, int k) { return 20 + n[0] * i + n[1] * j + n[2] * k; };
            const std::vector<float> uncut(3 * 512, 0.0F);
            Padded d = fill(plane);
            for (int i = 0; i < 8; ++i)
                for (int j = 0; j < 8; ++j)
                    for (int k = 0; k < 8; ++k) d[padded(i, j, k)] = 100;
            set->eikonal(d.data(), uncut.data(), ~RowMask{0}, 1e-6F);
            INFO(set->name << " " << n[0] << " " << n[1] << " " << n[2]);
            double worst = 0;
            for (int i = 0; i < 8; ++i)
                for (int j = 0; j < 8; ++j)
                    for (int k = 0; k < 8; ++k) worst = std::max(worst, std::abs(d[padded(i, j, k)] - plane(i, j, k)));
            CHECK(worst < 1e-3);
        }
}
