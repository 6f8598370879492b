#include "cloud/orientation/winding_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "cloud/orientation/heuristics.h"
#include "cloud/orientation/lattice_kernel.h"

namespace covol::cloud {
namespace {

constexpr int kCoarsening = 16;  // of the finest lattice, by halving

using Float4 = float __attribute__((vector_size(16)));

/// Cubic B-splines at a place: weights of 4 nodes along each axis, and their derivatives in cells.
struct Spline {
    Spline(const Lattice& l, const Vec3& world) {
        std::size_t index[3];
        for (int a = 0; a < 3; ++a) {
            const double at = std::clamp((world[a] - l.origin[a]) / l.cell, 1.0, double(l.nodes[a]) - 2.000001);
            index[a] = std::size_t(at);
            const float t = float(at - double(index[a])), s = 1 - t;
            w[a] = Float4{s * s * s, 4 - 6 * t * t + 3 * t * t * t, 4 - 6 * s * s + 3 * s * s * s, t * t * t} / 6.0F;
            d[a] = 0.5F * Float4{-s * s, -4 * t + 3 * t * t, 4 * s - 3 * s * s, t * t};
            --index[a];
        }
        first = (index[0] * std::size_t(l.nodes[1]) + index[1]) * std::size_t(l.nodes[2]) + index[2];
    }
    std::size_t first;  // of 4^3 nodes
    std::array<Float4, 3> w, d;
};

Float4 load4(const float* p) {
    Float4 v;
    std::memcpy(&v, p, sizeof v);
    return v;
}

double sum_of(Float4 v) { return double((v[0] + v[1]) + (v[2] + v[3])); }

struct Strides {
    explicit Strides(const Lattice& l)
        : i(std::size_t(l.nodes[1]) * std::size_t(l.nodes[2])), j(std::size_t(l.nodes[2])) {}
    [[nodiscard]] RowStrides row() const { return {std::ptrdiff_t(i), std::ptrdiff_t(j)}; }
    [[nodiscard]] std::size_t inner() const { return j - 2; }  // nodes of a row
    std::size_t i, j;
};

/// visit(i, j, first) for each row of inner nodes along k of a plane, `first` its node k = 0.
template <typename Visit>
void for_rows_of(const Lattice& l, int i, Visit visit) {
    const Strides s(l);
    for (int j = 1; j + 1 < l.nodes[1]; ++j) visit(i, j, std::size_t(i) * s.i + std::size_t(j) * s.j);
}

/// The same of all inner planes.
template <typename Visit>
void for_rows(const Lattice& l, Visit visit) {
    tbb::parallel_for(1, l.nodes[0] - 1, [&](int i) { for_rows_of(l, i, visit); });
}

const float* row_of(const std::vector<float>& values, std::size_t at) {
    return values.empty() ? nullptr : values.data() + at;
}

/// Gauss-Seidel in red and black order: (6 + screen) u - sum of neighbours = right.
void sweep(const Lattice& l, std::vector<float>& u, const std::vector<float>& right, const std::vector<float>& screen) {
    const Strides s(l);
    const auto sweep_plane = [&](int plane, int colour) {
        for_rows_of(l, plane, [&](int i, int j, std::size_t row) {
            sweep_row(u.data() + row + 1, right.data() + row + 1, row_of(screen, row + 1), s.row(), s.inner(),
                      std::size_t((i + j + colour) & 1));
        });
    };
    // Rows are read and written in vectors of both colours: planes beside each other may not be swept at once. The
    // order of colours holds all the same, for each second plane has what it needs of both planes beside it.
    const int end = l.nodes[0] - 1;
    tbb::parallel_for(1, end, 2, [&](int i) { sweep_plane(i, 0); });
    tbb::parallel_for(2, end, 2, [&](int i) {
        sweep_plane(i, 0);
        sweep_plane(i, 1);
    });
    tbb::parallel_for(1, end, 2, [&](int i) { sweep_plane(i, 1); });
}

void find_residual(const Lattice& l, const std::vector<float>& u, const std::vector<float>& right,
                   const std::vector<float>& screen, std::vector<float>& residual) {
    const Strides s(l);
    for_rows(l, [&](int, int, std::size_t row) {
        residual_row(u.data() + row + 1, right.data() + row + 1, row_of(screen, row + 1), s.row(), s.inner(),
                     residual.data() + row + 1);
    });
}

/// Full weighting; the right-hand side holds integrals over hats, whose sum over a coarser hat is this one's.
void restrict_to(const Lattice& fine, const std::vector<float>& residual, const Lattice& coarse,
                 std::vector<float>& right) {
    const Strides s(fine);
    for_rows(coarse, [&](int i, int j, std::size_t row) {
        thread_local std::vector<float> sums;
        sums.resize(s.inner());
        restrict_row(residual.data() + std::size_t(2 * i) * s.i + std::size_t(2 * j) * s.j + 1, s.row(), s.inner(),
                     sums.data());
        for (std::size_t k = 1; k + 1 < std::size_t(coarse.nodes[2]); ++k)
            // The stencil is h times the weak form's, and h doubles.
            right[row + k] = 0.5F * (0.5F * (sums[2 * k - 2] + sums[2 * k]) + sums[2 * k - 1]);
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
            smooth_row(values.data() + row + 1, std::ptrdiff_t(stride), s.inner(), scratch.data() + row + 1);
        });
        std::swap(values, scratch);
    }
}

/// Points by the slab of the lattice that they lie in, in which order they are summed whatever the number of threads.
class SlabOrder {
public:
    SlabOrder(const Lattice& l, const std::vector<Vec3>& points) : lattice_(l), points_(points) {
        const std::size_t slabs = std::size_t(l.nodes[0]) / kSlab + 1;
        std::vector<std::uint32_t> slab(points.size());
        tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
            slab[n] =
                std::uint32_t(std::clamp((points[n][0] - l.origin[0]) / l.cell, 0.0, double(l.nodes[0] - 1)) / kSlab);
        });
        starts_.assign(slabs + 1, 0);
        for (const std::uint32_t s : slab) ++starts_[s + 1];
        for (std::size_t s = 0; s < slabs; ++s) starts_[s + 1] += starts_[s];
        std::vector<std::size_t> next(starts_.begin(), starts_.end() - 1);
        order_.resize(points.size());
        for (std::size_t n = 0; n < points.size(); ++n) order_[next[slab[n]]++] = std::uint32_t(n);
    }

    /// Adds row(spline, point, i, j), a Float4, to the nodes around each point; slabs beside each other never at once.
    template <typename Row>
    void add(std::vector<float>& nodes, Row row) const {
        const Strides s(lattice_);
        for (std::size_t parity = 0; parity < 2; ++parity)
            tbb::parallel_for(std::size_t(0), starts_.size() / 2, [&](std::size_t pair) {
                const std::size_t slab = 2 * pair + parity;
                if (slab + 1 >= starts_.size()) return;
                for (std::size_t at = starts_[slab]; at < starts_[slab + 1]; ++at) {
                    const std::size_t n = order_[at];
                    const Spline b(lattice_, points_[n]);
                    for (std::size_t i = 0; i < 4; ++i)
                        for (std::size_t j = 0; j < 4; ++j) {
                            float* p = nodes.data() + b.first + i * s.i + j * s.j;
                            const Float4 sum = load4(p) + row(b, n, i, j);
                            std::memcpy(p, &sum, sizeof sum);
                        }
                }
            });
    }

private:
    static constexpr int kSlab = 8;  // nodes; a point reaches 4
    const Lattice& lattice_;
    const std::vector<Vec3>& points_;
    std::vector<std::uint32_t> order_;
    std::vector<std::size_t> starts_;
};

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

double LatticeField::value_at(const Vec3& world) const {
    const Spline b(lattice, world);
    const Strides s(lattice);
    Float4 sum{};
    for (std::size_t i = 0; i < 4; ++i) {
        const float* row = values.data() + b.first + i * s.i;
        sum += b.w[0][i] * (b.w[1][0] * load4(row) + b.w[1][1] * load4(row + s.j) + b.w[1][2] * load4(row + 2 * s.j) +
                            b.w[1][3] * load4(row + 3 * s.j));
    }
    return sum_of(sum * b.w[2]);
}

LatticeField::Sample LatticeField::at(const Vec3& world) const {
    const Spline b(lattice, world);
    const Strides s(lattice);
    Float4 sum{}, along_i{}, along_j{};
    for (std::size_t i = 0; i < 4; ++i) {
        const float* row = values.data() + b.first + i * s.i;
        Float4 here{}, slope{};
        for (std::size_t j = 0; j < 4; ++j) {
            const Float4 v = load4(row + j * s.j);
            here += b.w[1][j] * v;
            slope += b.d[1][j] * v;
        }
        sum += b.w[0][i] * here;
        along_i += b.d[0][i] * here;
        along_j += b.w[0][i] * slope;
    }
    return {sum_of(sum * b.w[2]),
            {sum_of(along_i * b.w[2]) / lattice.cell, sum_of(along_j * b.w[2]) / lattice.cell,
             sum_of(sum * b.d[2]) / lattice.cell}};
}

LatticeField spread(const Lattice& lattice, const std::vector<Vec3>& points, const std::vector<double>& values) {
    LatticeField sum(lattice);
    SlabOrder(lattice, points).add(sum.values, [&](const Spline& b, std::size_t n, std::size_t i, std::size_t j) {
        return float(values[n]) * b.w[0][i] * b.w[1][j] * b.w[2];
    });
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
        for (int sweeps = 0; sweeps < kWinding.coarsest_sweeps; ++sweeps) sweep(l, u, level.right, level.screen);
        return;
    }
    Level& coarse = levels_[n + 1];
    for (int sweeps = 0; sweeps < kWinding.sweeps; ++sweeps) sweep(l, u, level.right, level.screen);
    find_residual(l, u, level.right, level.screen, level.residual);
    restrict_to(l, level.residual, coarse.solution.lattice, coarse.right);
    std::fill(coarse.solution.values.begin(), coarse.solution.values.end(), 0.0F);
    cycle(n + 1);
    prolong(coarse.solution.lattice, coarse.solution.values, l, u);
    for (int sweeps = 0; sweeps < kWinding.sweeps; ++sweeps) sweep(l, u, level.right, level.screen);
}

void WindingField::solve(const std::vector<Vec3>& points, const std::vector<Vec3>& vectors, int cycles,
                         const RunContext& run) {
    Level& finest = levels_.front();
    const Lattice& l = finest.solution.lattice;
    std::fill(finest.right.begin(), finest.right.end(), 0.0F);
    const double area = 1 / (l.cell * l.cell);
    SlabOrder(l, points).add(finest.right, [&](const Spline& b, std::size_t n, std::size_t i, std::size_t j) {
        const float x = float(area * vectors[n][0]), y = float(area * vectors[n][1]), z = float(area * vectors[n][2]);
        return -((x * b.d[0][i] * b.w[1][j] + y * b.w[0][i] * b.d[1][j]) * b.w[2] +
                 (z * b.w[0][i] * b.w[1][j]) * b.d[2]);
    });
    for (std::size_t n = 0; n < finest.screen.size(); ++n) finest.right[n] += 0.5F * finest.screen[n];
    for (int n = 0; n < cycles; ++n) {
        run.check();
        cycle(0);
    }
}

void WindingField::start_from(const LatticeField& other) {
    LatticeField& u = levels_.front().solution;
    const Lattice& l = u.lattice;
    for_rows(l, [&](int i, int j, std::size_t row) {
        for (int k = 1; k + 1 < l.nodes[2]; ++k)
            u.values[row + std::size_t(k)] =
                float(other.value_at({l.origin[0] + i * l.cell, l.origin[1] + j * l.cell, l.origin[2] + k * l.cell}));
    });
}

void WindingField::screen(const std::vector<Vec3>& points, const std::vector<double>& weights) {
    levels_.front().screen = spread(levels_.front().solution.lattice, points, weights).values;
    for (std::size_t n = 1; n < levels_.size(); ++n) {
        levels_[n].screen.assign(levels_[n].right.size(), 0.0F);
        restrict_to(levels_[n - 1].solution.lattice, levels_[n - 1].screen, levels_[n].solution.lattice,
                    levels_[n].screen);
    }
}

void WindingField::multiply(double factor) {
    for (float& value : levels_.front().solution.values) value *= float(factor);
}

}  // namespace covol::cloud
