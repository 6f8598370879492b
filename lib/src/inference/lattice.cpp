#include "inference/lattice.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "grid/levels_at.h"
#include "inference/heuristics.h"

namespace covol::inference {
namespace {

/// The lines of a field along an axis: their first nodes, and the step along them.
struct Lines {
    Lines(const Lattice& lattice, int axis) : lattice_(lattice), axis_(axis), length(lattice.size[axis]) {
        const std::size_t steps[3] = {1, std::size_t(lattice.size[0]),
                                      std::size_t(lattice.size[0]) * std::size_t(lattice.size[1])};
        step = steps[axis];
        a_ = axis == 0 ? 1 : 0;
        b_ = axis == 2 ? 1 : 2;
        step_a_ = steps[a_];
        step_b_ = steps[b_];
    }
    /// Calls visit(first node) for each line, in parallel.
    template <typename Visit>
    void for_each(const Visit& visit) const {
        tbb::parallel_for(0, lattice_.size[b_], [&](int b) {
            for (int a = 0; a < lattice_.size[a_]; ++a) visit(std::size_t(a) * step_a_ + std::size_t(b) * step_b_);
        });
    }

private:
    const Lattice& lattice_;
    int axis_, a_, b_;
    std::size_t step_a_, step_b_;

public:
    int length;
    std::size_t step;
};

}  // namespace

Vec3 to_frame(const ImageGeometry& geometry, const Vec3& world) {
    const Vec3 index = geometry.world_to_index(world);
    return {index[0] * geometry.spacing[0], index[1] * geometry.spacing[1], index[2] * geometry.spacing[2]};
}

Vec3 to_world(const ImageGeometry& geometry, const Vec3& place) {
    return geometry.index_to_world(
        {place[0] / geometry.spacing[0], place[1] / geometry.spacing[1], place[2] / geometry.spacing[2]});
}

double Lattice::finest() const { return std::min({spacing[0], spacing[1], spacing[2]}); }

double Lattice::cell_along(const Vec3& unit) const {
    double squares = 0;
    for (int a = 0; a < 3; ++a) squares += unit[a] * unit[a] / (spacing[a] * spacing[a]);
    return 1 / std::sqrt(squares);
}

double Lattice::extent_along(const Vec3& unit) const {
    return std::hypot(unit[0] * spacing[0], unit[1] * spacing[1], unit[2] * spacing[2]);
}

double Lattice::value(const Field& field, const Vec3& place) const {
    int first[3], next[3];
    double part[3];
    for (int a = 0; a < 3; ++a) {
        const double at = std::clamp((place[a] - origin[a]) / spacing[a], 0.0, double(size[a] - 1));
        first[a] = std::min(int(at), size[a] - 1);
        next[a] = std::min(first[a] + 1, size[a] - 1);
        part[a] = at - first[a];
    }
    const auto mix = [](double a, double b, double w) { return a + w * (b - a); };
    const auto along = [&](int j, int k) {
        return mix(field[node(first[0], j, k)], field[node(next[0], j, k)], part[0]);
    };
    const auto across = [&](int k) { return mix(along(first[1], k), along(next[1], k), part[1]); };
    return mix(across(first[2]), across(next[2]), part[2]);
}

Lattice cover(const ImageGeometry& geometry, const Vec3& low, const Vec3& high, double maximum) {
    Lattice lattice;
    Vec3 first, last;
    for (int a = 0; a < 3; ++a) {
        const double end = geometry.spacing[a] * (geometry.size[a] - 1);
        first[a] = std::clamp(low[a], 0.0, end);
        last[a] = std::clamp(high[a], 0.0, end);
    }
    const auto with = [&](double cell) {
        for (int a = 0; a < 3; ++a) {
            const double voxel = geometry.spacing[a];
            if (cell <= voxel) {
                const int from = int(std::floor(first[a] / voxel)), to = int(std::ceil(last[a] / voxel));
                lattice.spacing[a] = voxel;
                lattice.origin[a] = from * voxel;
                lattice.size[a] = std::min(to, geometry.size[a] - 1) - from + 1;
            } else {
                const int cells = std::max(1, int(std::floor((last[a] - first[a]) / cell)));
                lattice.spacing[a] = cell;
                lattice.size[a] = cells + 1;
                lattice.origin[a] = 0.5 * (first[a] + last[a] - cells * cell);
            }
        }
        return double(lattice.count());
    };
    double cell = 0;
    if (with(cell) <= maximum) return lattice;
    double fine = geometry.smallest_spacing(), coarse = fine;
    while (with(coarse) > maximum) coarse *= 2;
    for (int round = 0; round < 30; ++round) {
        cell = 0.5 * (fine + coarse);
        (with(cell) > maximum ? fine : coarse) = cell;
    }
    with(coarse);
    return lattice;
}

double fine_nodes() { return 2 * 2 * 2 * kInference.coarse_nodes; }

std::vector<double> levels_on(const Lattice& lattice, const ImageGeometry& geometry, const FloatGrid& u) {
    std::vector<Vec3> places;
    places.reserve(lattice.count());
    for (std::size_t n = 0; n < lattice.count(); ++n) places.push_back(to_world(geometry, lattice.place_of(n)));
    return detail::levels_at(u, places);
}

bool is_too_large(const Lattice& lattice, const ImageGeometry& geometry, const RunContext& run) {
    double voxels = 1;
    for (int a = 0; a < 3; ++a) voxels *= (lattice.size[a] - 1) * lattice.spacing[a] / geometry.spacing[a] + 1;
    // The box is not copied as a whole, but the chunks that cover it, which may be twice as large, are held in memory.
    return voxels > kInference.max_voxels ||
           (run.memory_budget > 0 && 2 * sizeof(float) * voxels > double(run.memory_budget));
}

Field sample(const Image& image, const Lattice& lattice, const RunContext& run) {
    const ImageGeometry& g = image.geometry();
    Index3 first, last;
    for (int a = 0; a < 3; ++a) {  // all voxels within one spacing of some node
        const double begin = lattice.origin[a] - lattice.spacing[a],
                     end = lattice.origin[a] + lattice.spacing[a] * lattice.size[a];
        first[a] = std::clamp(int(std::ceil(begin / g.spacing[a] + 1e-6)), image.held().min[a], image.held().max[a]);
        last[a] = std::clamp(int(std::floor(end / g.spacing[a] - 1e-6)), image.held().min[a], image.held().max[a]);
    }
    image.load({first, last}, run);
    const std::size_t plane = std::size_t(lattice.size[0]) * std::size_t(lattice.size[1]);
    Field result(lattice.count());
    // The value at a node is a mean over voxels: this is the weight of a voxel for a node along one axis.
    const auto weight = [&](int a, int node, int voxel) {
        const double away = std::abs(lattice.origin[a] + node * lattice.spacing[a] - voxel * g.spacing[a]);
        return std::max(0.0, 1 - away / lattice.spacing[a]);
    };
    struct Tap {
        int first = 0;
        std::vector<float> weight;
    };
    std::array<std::vector<Tap>, 3> taps;
    for (int a = 0; a < 3; ++a) {
        taps[a].resize(std::size_t(lattice.size[a]));
        for (int n = 0; n < lattice.size[a]; ++n) {
            Tap& tap = taps[a][std::size_t(n)];
            const double at = lattice.origin[a] + n * lattice.spacing[a];
            int from = int(std::ceil((at - lattice.spacing[a]) / g.spacing[a] - 1e-9)),
                to = int(std::floor((at + lattice.spacing[a]) / g.spacing[a] + 1e-9));
            from = std::clamp(from, first[a], last[a]);
            to = std::clamp(to, from, last[a]);
            double sum = 0;
            tap.first = from;
            for (int v = from; v <= to; ++v) {
                tap.weight.push_back(float(weight(a, n, v)));
                sum += double(tap.weight.back());
            }
            if (!(sum > 0)) {
                tap.weight.assign(1, 1.0F);
                sum = 1;
            }
            for (float& w : tap.weight) w = float(double(w) / sum);
        }
    }
    const int row = last[0] - first[0] + 1, rows = last[1] - first[1] + 1;
    tbb::parallel_for(0, lattice.size[2], [&](int k) {
        std::vector<float> slice(std::size_t(row) * std::size_t(rows)), sum(slice.size(), 0.0F), lines;
        const Tap& deep = taps[2][std::size_t(k)];
        for (std::size_t n = 0; n < deep.weight.size(); ++n) {
            if (deep.weight[n] == 0) continue;
            const int z = deep.first + int(n);
            image.copy({{first[0], first[1], z}, {last[0], last[1], z}}, slice.data());
            for (std::size_t v = 0; v < slice.size(); ++v) sum[v] += deep.weight[n] * slice[v];
        }
        lines.assign(std::size_t(row) * std::size_t(lattice.size[1]), 0.0F);
        for (int j = 0; j < lattice.size[1]; ++j) {
            const Tap& tap = taps[1][std::size_t(j)];
            for (std::size_t n = 0; n < tap.weight.size(); ++n) {
                const float* from = sum.data() + std::size_t(tap.first + int(n) - first[1]) * std::size_t(row);
                float* to = lines.data() + std::size_t(j) * std::size_t(row);
                for (int x = 0; x < row; ++x) to[x] += tap.weight[n] * from[x];
            }
        }
        for (int j = 0; j < lattice.size[1]; ++j)
            for (int i = 0; i < lattice.size[0]; ++i) {
                const Tap& tap = taps[0][std::size_t(i)];
                const float* from = lines.data() + std::size_t(j) * std::size_t(row) + (tap.first - first[0]);
                float value = 0;
                for (std::size_t n = 0; n < tap.weight.size(); ++n) value += tap.weight[n] * from[n];
                result[std::size_t(k) * plane + std::size_t(j) * std::size_t(lattice.size[0]) + std::size_t(i)] = value;
            }
    });
    image.release();
    return result;
}

Field smooth(const Lattice& lattice, const Field& field, double sigma) {
    Field result = field;
    for (int axis = 0; axis < 3; ++axis) {
        const double cells = sigma / lattice.spacing[axis];
        const int radius = int(std::ceil(3 * cells));
        std::vector<float> kernel;
        double sum = 0;
        for (int n = -radius; n <= radius; ++n) {
            kernel.push_back(float(std::exp(-0.5 * n * n / (cells * cells))));
            sum += double(kernel.back());
        }
        for (float& w : kernel) w = float(double(w) / sum);
        const Lines lines(lattice, axis);
        lines.for_each([&](std::size_t first) {
            thread_local std::vector<float> line, out;
            line.resize(std::size_t(lines.length + 2 * radius));
            out.assign(std::size_t(lines.length), 0.0F);
            for (int n = -radius; n < lines.length + radius; ++n)
                line[std::size_t(n + radius)] =
                    result[first + std::size_t(std::clamp(n, 0, lines.length - 1)) * lines.step];
            for (std::size_t w = 0; w < kernel.size(); ++w)
                for (std::size_t n = 0; n < out.size(); ++n) out[n] += kernel[w] * line[n + w];
            for (std::size_t n = 0; n < out.size(); ++n) result[first + n * lines.step] = out[n];
        });
    }
    return result;
}

Field derivative(const Lattice& lattice, const Field& field, int axis) {
    Field result(field.size(), 0.0F);
    const Lines lines(lattice, axis);
    if (lines.length < 2) return result;
    lines.for_each([&](std::size_t first) {
        for (int n = 0; n < lines.length; ++n) {
            const int before = std::max(n - 1, 0), after = std::min(n + 1, lines.length - 1);
            result[first + std::size_t(n) * lines.step] =
                float(double(field[first + std::size_t(after) * lines.step] -
                             field[first + std::size_t(before) * lines.step]) /
                      ((after - before) * lattice.spacing[axis]));
        }
    });
    return result;
}

namespace {

/// Replaces `squares`, which is 0 at some nodes and 1e20 at the others, by the squared distance to the nearest node at
/// which it is 0: Felzenszwalb and Huttenlocher, Distance transforms of sampled functions, Theory of Computing 8, 2012.
void squared_distance_to(const Lattice& lattice, std::vector<float>& squares) {
    constexpr float kFar = 1e20F;
    for (int axis = 0; axis < 3; ++axis) {
        const Lines lines(lattice, axis);
        const double h = lattice.spacing[axis];
        lines.for_each([&](std::size_t first) {
            thread_local std::vector<double> value, border;
            thread_local std::vector<int> lowest;
            const int count = lines.length;
            value.resize(std::size_t(count));
            border.resize(std::size_t(count) + 1);
            lowest.resize(std::size_t(count));
            for (int n = 0; n < count; ++n) value[std::size_t(n)] = squares[first + std::size_t(n) * lines.step];
            int last = -1;
            for (int n = 0; n < count; ++n) {
                if (value[std::size_t(n)] >= kFar) continue;
                const double at = n * h;
                double from = -std::numeric_limits<double>::infinity();
                while (last >= 0) {
                    const double other = lowest[std::size_t(last)] * h;
                    from = (value[std::size_t(n)] + at * at - value[std::size_t(lowest[std::size_t(last)])] -
                            other * other) /
                           (2 * (at - other));
                    if (from > border[std::size_t(last)]) break;
                    --last;
                    from = -std::numeric_limits<double>::infinity();
                }
                ++last;
                lowest[std::size_t(last)] = n;
                border[std::size_t(last)] = from;
            }
            if (last < 0) return;
            for (int n = 0, part = 0; n < count; ++n) {
                while (part < last && border[std::size_t(part) + 1] < n * h) ++part;
                const double to = (n - lowest[std::size_t(part)]) * h;
                squares[first + std::size_t(n) * lines.step] =
                    float(value[std::size_t(lowest[std::size_t(part)])] + to * to);
            }
        });
    }
}

}  // namespace

Field signed_distance(const Lattice& lattice, const std::vector<char>& inside) {
    std::vector<float> to_body(inside.size()), to_rest(inside.size());
    for (std::size_t n = 0; n < inside.size(); ++n) {
        to_body[n] = inside[n] != 0 ? 0.0F : 1e20F;
        to_rest[n] = inside[n] != 0 ? 1e20F : 0.0F;
    }
    squared_distance_to(lattice, to_body);
    squared_distance_to(lattice, to_rest);
    const auto half = float(0.5 * lattice.finest());
    Field result(inside.size());
    for (std::size_t n = 0; n < inside.size(); ++n)
        result[n] = inside[n] != 0 ? half - std::sqrt(to_rest[n]) : std::sqrt(to_body[n]) - half;
    return result;
}

Parts label_parts(const Lattice& lattice, const std::vector<char>& inside) {
    Parts parts;
    parts.number.assign(inside.size(), 0);
    std::vector<std::size_t> open;
    const std::size_t dy = std::size_t(lattice.size[0]), dz = dy * std::size_t(lattice.size[1]);
    for (std::size_t seed = 0; seed < inside.size(); ++seed) {
        if (inside[seed] == 0 || parts.number[seed] != 0) continue;
        parts.number[seed] = ++parts.count;
        open.push_back(seed);
        while (!open.empty()) {
            const std::size_t n = open.back();
            open.pop_back();
            const auto visit = [&](bool there, std::size_t other) {
                if (!there || inside[other] == 0 || parts.number[other] != 0) return;
                parts.number[other] = parts.count;
                open.push_back(other);
            };
            const std::size_t i = n % dy, j = n / dy % std::size_t(lattice.size[1]), k = n / dz;
            visit(i > 0, n - 1);
            visit(i + 1 < dy, n + 1);
            visit(j > 0, n - dy);
            visit(j + 1 < std::size_t(lattice.size[1]), n + dy);
            visit(k > 0, n - dz);
            visit(k + 1 < std::size_t(lattice.size[2]), n + dz);
        }
    }
    return parts;
}

}  // namespace covol::inference
