#include "cloud/winding_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace covol::cloud {
namespace {

constexpr int kCoarsening = 16;    // of the finest lattice, by halving
constexpr int kSweeps = 1;         // before and after each correction
constexpr int kCoarsestSweeps = 16;

/// Cubic B-splines at a place: weights of 4 nodes along each axis, and their derivatives in cells.
struct Spline {
    Spline(const Lattice& l, const Vec3& world) {
        std::size_t index[3];
        for (int a = 0; a < 3; ++a) {
            const double at = std::clamp((world[a] - l.origin[a]) / l.cell, 1.0, double(l.nodes[a]) - 2.000001);
            index[a] = std::size_t(at);
            const double t = at - double(index[a]), s = 1 - t;
            w[a] = {s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * s * s + 3 * s * s * s) / 6, t * t * t / 6};
            d[a] = {-s * s / 2, (-4 * t + 3 * t * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2};
            --index[a];
        }
        first = (index[0] * std::size_t(l.nodes[1]) + index[1]) * std::size_t(l.nodes[2]) + index[2];
    }
    std::size_t first;  // of 4^3 nodes
    std::array<std::array<double, 4>, 3> w, d;
};

struct Strides {
    explicit Strides(const Lattice& l) : i(std::size_t(l.nodes[1]) * std::size_t(l.nodes[2])), j(std::size_t(l.nodes[2])) {}
    std::size_t i, j;
};

/// visit(i, j, first) for each row of inner nodes along k, `first` its node k = 0.
template <typename Visit>
void for_rows(const Lattice& l, Visit visit) {
    const Strides s(l);
    tbb::parallel_for(1, l.nodes[0] - 1, [&](int i) {
        for (int j = 1; j + 1 < l.nodes[1]; ++j) visit(i, j, std::size_t(i) * s.i + std::size_t(j) * s.j);
    });
}

/// Gauss-Seidel in red and black order: (6 + screen) u - sum of neighbours = right.
void sweep(const Lattice& l, std::vector<float>& u, const std::vector<float>& right, const std::vector<float>& screen) {
    const Strides s(l);
    const auto visit = [&](const auto& inverse_diagonal) {
        for (int colour = 0; colour < 2; ++colour)
            for_rows(l, [&](int i, int j, std::size_t row) {
                for (std::size_t at = row + 1 + std::size_t((i + j + colour) & 1), end = row + s.j - 1; at < end; at += 2)
                    u[at] = (right[at] + u[at - s.i] + u[at + s.i] + u[at - s.j] + u[at + s.j] + u[at - 1] + u[at + 1]) * inverse_diagonal(at);
            });
    };
    if (screen.empty()) visit([](std::size_t) { return 1.0F / 6.0F; });
    else visit([&](std::size_t at) { return 1 / (6 + screen[at]); });
}

void find_residual(const Lattice& l, const std::vector<float>& u, const std::vector<float>& right, const std::vector<float>& screen,
                   std::vector<float>& residual) {
    const Strides s(l);
    for_rows(l, [&](int, int, std::size_t row) {
        for (std::size_t at = row + 1, end = row + s.j - 1; at < end; ++at)
            residual[at] = right[at] - (screen.empty() ? 6.0F : 6 + screen[at]) * u[at] + u[at - s.i] + u[at + s.i] + u[at - s.j] + u[at + s.j] + u[at - 1] + u[at + 1];
    });
}

/// Full weighting; the right-hand side holds integrals over hats, whose sum over a coarser hat is this one's.
void restrict_to(const Lattice& fine, const std::vector<float>& residual, const Lattice& coarse, std::vector<float>& right) {
    const Strides s(fine), t(coarse);
    const float weight[3] = {0.5F, 1.0F, 0.5F};
    for_rows(coarse, [&](int i, int j, std::size_t row) {
        for (int k = 1; k + 1 < coarse.nodes[2]; ++k) {
            const std::size_t at = std::size_t(2 * i) * s.i + std::size_t(2 * j) * s.j + std::size_t(2 * k);
            float sum = 0;
            for (int a = 0; a < 3; ++a)
                for (int b = 0; b < 3; ++b) {
                    const float* p = residual.data() + (at + std::size_t(a) * s.i + std::size_t(b) * s.j - s.i - s.j);
                    sum += weight[a] * weight[b] * (0.5F * (p[-1] + p[1]) + p[0]);
                }
            right[row + std::size_t(k)] = 0.5F * sum;  // the stencil is h times the weak form's, and h doubles
        }
    });
}

/// Adds the trilinear interpolation of `coarse`.
void prolong(const Lattice& coarse, const std::vector<float>& from, const Lattice& fine, std::vector<float>& to) {
    const Strides s(fine), t(coarse);
    for_rows(fine, [&](int i, int j, std::size_t row) {
        const std::size_t low = std::size_t(i / 2) * t.i + std::size_t(j / 2) * t.j;
        const std::size_t up_i = (i & 1) ? t.i : 0, up_j = (j & 1) ? t.j : 0;
        const auto column = [&](std::size_t k) {
            const float* p = from.data() + low + k;
            return 0.25F * (p[0] + p[up_i] + p[up_j] + p[up_i + up_j]);
        };
        float here = column(0);
        for (int k = 0; k + 1 < fine.nodes[2]; k += 2) {
            const float next = column(std::size_t(k / 2 + 1));
            if (k > 0) to[row + std::size_t(k)] += here;
            to[row + std::size_t(k + 1)] += 0.5F * (here + next);
            here = next;
        }
    });
}

/// One pass of (1 2 1) / 4 along each axis.
void smooth(const Lattice& l, std::vector<float>& values, std::vector<float>& scratch) {
    const Strides s(l);
    for (const std::size_t stride : {s.i, s.j, std::size_t(1)}) {
        for_rows(l, [&](int, int, std::size_t row) {
            for (std::size_t at = row + 1, end = row + s.j - 1; at < end; ++at)
                scratch[at] = 0.5F * values[at] + 0.25F * (values[at - stride] + values[at + stride]);
        });
        std::swap(values, scratch);
    }
}

}  // namespace

Lattice lattice_around(const WorldBox& box, double share, int cells) {
    const double longest = longest_side(box);
    Lattice l;
    l.cell = longest * (1 + 2 * share) / cells;
    for (int a = 0; a < 3; ++a) {
        const double side = box.max[a] - box.min[a] + 2 * share * longest;
        const int needed = std::max(kCoarsening, int(std::ceil(side / l.cell / kCoarsening - 1e-9)) * kCoarsening);
        l.nodes[a] = needed + 1;
        l.origin[a] = 0.5 * (box.min[a] + box.max[a]) - 0.5 * needed * l.cell;
    }
    return l;
}

LatticeField::Sample LatticeField::at(const Vec3& world) const {
    const Spline b(lattice, world);
    const Strides s(lattice);
    Sample sample{0, {0, 0, 0}};
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 4; ++j) {
            const float* row = values.data() + b.first + i * s.i + j * s.j;
            double sum = 0, slope = 0;
            for (std::size_t k = 0; k < 4; ++k) {
                sum += b.w[2][k] * double(row[k]);
                slope += b.d[2][k] * double(row[k]);
            }
            sample.value += b.w[0][i] * b.w[1][j] * sum;
            sample.gradient[0] += b.d[0][i] * b.w[1][j] * sum;
            sample.gradient[1] += b.w[0][i] * b.d[1][j] * sum;
            sample.gradient[2] += b.w[0][i] * b.w[1][j] * slope;
        }
    for (double& g : sample.gradient) g /= lattice.cell;
    return sample;
}

LatticeField spread(const Lattice& lattice, const std::vector<Vec3>& points, const std::vector<double>& values) {
    LatticeField sum(lattice);
    const Strides s(lattice);
    for (std::size_t n = 0; n < points.size(); ++n) {
        const Spline b(lattice, points[n]);
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t j = 0; j < 4; ++j)
                for (std::size_t k = 0; k < 4; ++k)
                    sum.values[b.first + i * s.i + j * s.j + k] += float(values[n] * b.w[0][i] * b.w[1][j] * b.w[2][k]);
    }
    return sum;
}

LatticeField point_density(const Lattice& lattice, const std::vector<Vec3>& points, int passes) {
    LatticeField density = spread(lattice, points, std::vector<double>(points.size(), 1.0));
    std::vector<float> scratch(passes > 0 ? lattice.size() : 0);
    for (int pass = 0; pass < passes; ++pass) smooth(lattice, density.values, scratch);
    return density;
}

WindingField::WindingField(const Lattice& lattice) {
    Lattice l = lattice;
    for (int factor = 1; factor <= kCoarsening; factor *= 2) {
        levels_.push_back({LatticeField(l), std::vector<float>(l.size()), std::vector<float>(l.size()), {}});
        l.cell *= 2;
        for (int& n : l.nodes) n = (n - 1) / 2 + 1;
        if (*std::min_element(l.nodes.begin(), l.nodes.end()) < 3) break;
    }
}

void WindingField::cycle(std::size_t n) {
    Level& level = levels_[n];
    const Lattice& l = level.solution.lattice;
    std::vector<float>& u = level.solution.values;
    if (n + 1 == levels_.size()) {
        for (int sweeps = 0; sweeps < kCoarsestSweeps; ++sweeps) sweep(l, u, level.right, level.screen);
        return;
    }
    Level& coarse = levels_[n + 1];
    for (int sweeps = 0; sweeps < kSweeps; ++sweeps) sweep(l, u, level.right, level.screen);
    find_residual(l, u, level.right, level.screen, level.residual);
    restrict_to(l, level.residual, coarse.solution.lattice, coarse.right);
    std::fill(coarse.solution.values.begin(), coarse.solution.values.end(), 0.0F);
    cycle(n + 1);
    prolong(coarse.solution.lattice, coarse.solution.values, l, u);
    for (int sweeps = 0; sweeps < kSweeps; ++sweeps) sweep(l, u, level.right, level.screen);
}

void WindingField::solve(const std::vector<Vec3>& points, const std::vector<Vec3>& vectors, int cycles) {
    Level& finest = levels_.front();
    const Lattice& l = finest.solution.lattice;
    const Strides s(l);
    std::fill(finest.right.begin(), finest.right.end(), 0.0F);
    const double area = 1 / (l.cell * l.cell);
    for (std::size_t n = 0; n < points.size(); ++n) {
        const Spline b(l, points[n]);
        const Vec3 v{area * vectors[n][0], area * vectors[n][1], area * vectors[n][2]};
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t j = 0; j < 4; ++j) {
                const double across = v[0] * b.d[0][i] * b.w[1][j] + v[1] * b.w[0][i] * b.d[1][j], along = v[2] * b.w[0][i] * b.w[1][j];
                float* row = finest.right.data() + b.first + i * s.i + j * s.j;
                for (std::size_t k = 0; k < 4; ++k) row[k] -= float(across * b.w[2][k] + along * b.d[2][k]);
            }
    }
    for (std::size_t n = 0; n < finest.screen.size(); ++n) finest.right[n] += 0.5F * finest.screen[n];
    for (int n = 0; n < cycles; ++n) cycle(0);
}

void WindingField::start_from(const LatticeField& other) {
    LatticeField& u = levels_.front().solution;
    const Lattice& l = u.lattice;
    for_rows(l, [&](int i, int j, std::size_t row) {
        for (int k = 1; k + 1 < l.nodes[2]; ++k)
            u.values[row + std::size_t(k)] = float(other.at({l.origin[0] + i * l.cell, l.origin[1] + j * l.cell, l.origin[2] + k * l.cell}).value);
    });
}

void WindingField::screen(const std::vector<Vec3>& points, const std::vector<double>& weights) {
    levels_.front().screen = spread(levels_.front().solution.lattice, points, weights).values;
    for (std::size_t n = 1; n < levels_.size(); ++n) {
        levels_[n].screen.assign(levels_[n].right.size(), 0.0F);
        restrict_to(levels_[n - 1].solution.lattice, levels_[n - 1].screen, levels_[n].solution.lattice, levels_[n].screen);
    }
}

void WindingField::multiply(double factor) {
    for (float& value : levels_.front().solution.values) value *= float(factor);
}

}  // namespace covol::cloud
