#include "contours/section_field.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <tuple>

#include "base/geometry.h"

namespace covol::detail {
namespace {

constexpr std::size_t kMaxFieldNodes = 6'000'000;
constexpr std::size_t kMaxStops = 20'000'000;  // maximum number of PlaneCrossings, of 16 bytes each: limits the memory
constexpr int kCoarsest = 16;                  // maximum number of cells along the longest side of the first lattice
constexpr float kSettled = 1e-4F;              // maximum change of a value in a sweep after which the sweeps end
constexpr int kMaxSweeps = 400;
constexpr std::size_t kFolds = 6;
constexpr float kClosest = 1e-3F;  // [cells] minimum distance of a node from a plane in its equation

using Size = std::array<int, 3>;
using Planes = std::vector<const SectionLevels*>;

/// The crossing of an edge of the lattice with a plane, for one of the two nodes of the edge.
struct PlaneCrossing {
    std::uint32_t node;
    std::uint8_t direction;  // 2 * axis, + 1 towards larger indices
    float distance, value;   // distance from the node in cells, and the value on the plane
};

/// The equation of a node beside a plane: its value is `known` plus the sum of weight * value over its neighbours.
struct NodeEquation {
    std::array<float, 6> weight{};  // of neighbours, by direction
    float known = 0;                // contribution of the planes' values
};

struct Lattice {
    Vec3 low;
    double cell;
    Size size;
    [[nodiscard]] std::size_t count() const {
        return std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]);
    }
    [[nodiscard]] std::array<std::ptrdiff_t, 3> strides() const {
        return {std::ptrdiff_t(size[1]) * size[2], size[2], 1};
    }
};

Lattice lattice_of(const WorldBox& box, double cell) {
    Lattice lattice{box.min, cell, {}};
    for (int a = 0; a < 3; ++a) lattice.size[a] = int(std::ceil((box.max[a] - box.min[a]) / cell)) + 1;
    return lattice;
}

double trilinear(const std::vector<float>& values, const Lattice& lattice, const Vec3& at) {
    std::array<int, 3> low;
    Vec3 part;
    for (int a = 0; a < 3; ++a) {
        const double t = (at[a] - lattice.low[a]) / lattice.cell;
        if (!(t >= 0 && t <= lattice.size[a] - 1)) return 1;
        low[a] = std::min(int(t), lattice.size[a] - 2);
        part[a] = t - low[a];
    }
    const auto stride = lattice.strides();
    const float* corner = values.data() + low[0] * stride[0] + low[1] * stride[1] + low[2];
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
        const int i = c >> 2 & 1, j = c >> 1 & 1, k = c & 1;
        sum += (i != 0 ? part[0] : 1 - part[0]) * (j != 0 ? part[1] : 1 - part[1]) * (k != 0 ? part[2] : 1 - part[2]) *
               double(corner[i * stride[0] + j * stride[1] + k]);
    }
    return sum;
}

/// All edges of the lattice that one of the planes crosses, listed at both their nodes.
std::vector<PlaneCrossing> crossings_of(const Planes& planes, const Lattice& lattice, const RunContext& run) {
    const auto stride = lattice.strides();
    std::vector<std::vector<PlaneCrossing>> found(planes.size());
    tbb::parallel_for(std::size_t(0), planes.size(), [&](std::size_t n) {
        const SectionPlane& plane = planes[n]->plane;
        for (int a = 0; a < 3; ++a) {
            if (plane.normal[a] == 0) continue;
            const int b = (a + 1) % 3, c = (a + 2) % 3;
            for (int j = 1; j + 1 < lattice.size[b]; ++j)
                for (int k = 1; k + 1 < lattice.size[c]; ++k) {
                    Vec3 at = lattice.low;
                    at[b] += j * lattice.cell;
                    at[c] += k * lattice.cell;
                    const double t = -plane.height(at) / (plane.normal[a] * lattice.cell);
                    if (!(t >= 0 && t < lattice.size[a] - 1)) continue;
                    const int i = int(t);
                    at[a] += t * lattice.cell;
                    const double level = planes[n]->at(plane.flat(at));
                    const auto value = float(std::clamp(level / lattice.cell, -1.0, 1.0));
                    const auto node = std::uint32_t(i * stride[a] + j * stride[b] + k * stride[c]);
                    const auto part = float(t - i);
                    found[n].push_back({node, std::uint8_t(2 * a + 1), std::max(part, kClosest), value});
                    found[n].push_back(
                        {std::uint32_t(node + stride[a]), std::uint8_t(2 * a), std::max(1 - part, kClosest), value});
                }
        }
    });
    run.check();
    std::vector<PlaneCrossing> stops;
    for (const std::vector<PlaneCrossing>& some : found) stops.insert(stops.end(), some.begin(), some.end());
    tbb::parallel_sort(stops, [](const PlaneCrossing& a, const PlaneCrossing& b) {
        return std::tie(a.node, a.direction, a.distance, a.value) < std::tie(b.node, b.direction, b.distance, b.value);
    });
    return stops;
}

/// Solves Laplace's equation on a lattice whose border is outside.
class Solver {
public:
    Solver(const Planes& planes, const Lattice& lattice, const RunContext& run)
        : lattice_(lattice), run_(run), entry_(lattice.count(), -1) {
        make_entries(crossings_of(planes, lattice, run));
    }

    /// By successive over-relaxation.
    /// @param across  number of cells between planes, from which the relaxation factor is computed
    void solve(std::vector<float>& values, double across) const {
        const auto factor = float(2 / (1 + std::sin(std::numbers::pi / std::max(across, 3.0))));
        for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
            run_.check();
            const double change = std::max(half_sweep(values, 0, factor), half_sweep(values, 1, factor));
            if (change < double(kSettled)) break;
        }
    }

private:
    void make_entries(const std::vector<PlaneCrossing>& stops) {
        for (std::size_t n = 0; n < stops.size();) {
            const std::uint32_t node = stops[n].node;
            std::array<float, 6> distance, value{};
            distance.fill(1);
            std::array<bool, 6> is_stopped{};
            for (; n < stops.size() && stops[n].node == node; ++n) {
                const int d = stops[n].direction;
                if (is_stopped[d]) continue;  // by a closer plane
                is_stopped[d] = true;
                distance[d] = stops[n].distance;
                value[d] = stops[n].value;
            }
            NodeEquation beside;
            float sum = 0;
            for (int d = 0; d < 6; ++d) sum += beside.weight[d] = 2 / (distance[d] * (distance[d] + distance[d ^ 1]));
            for (int d = 0; d < 6; ++d) {
                beside.weight[d] /= sum;
                if (!is_stopped[d]) continue;
                beside.known += beside.weight[d] * value[d];
                beside.weight[d] = 0;
            }
            entry_[node] = std::int32_t(equations_.size());
            equations_.push_back(beside);
        }
    }

    /// Updates every second node, as on a chessboard; these depend on the others alone. @return the maximum change
    double half_sweep(std::vector<float>& values, int colour, float factor) const {
        const auto [di, dj, dk] = lattice_.strides();
        return tbb::parallel_reduce(
            tbb::blocked_range<int>(1, lattice_.size[0] - 1), 0.0,
            [&, di = di, dj = dj, dk = dk](const tbb::blocked_range<int>& range, double change) {
                for (int i = range.begin(); i < range.end(); ++i)
                    for (int j = 1; j + 1 < lattice_.size[1]; ++j)
                        for (int k = 1 + (i + j + colour) % 2; k + 1 < lattice_.size[2]; k += 2) {
                            float* v = values.data() + i * di + j * dj + k;
                            const std::int32_t entry = entry_[std::size_t(v - values.data())];
                            float wanted;
                            if (entry < 0) {
                                wanted = (v[-di] + v[di] + v[-dj] + v[dj] + v[-dk] + v[dk]) / 6;
                            } else {
                                const NodeEquation& b = equations_[std::size_t(entry)];
                                wanted = b.known + b.weight[0] * v[-di] + b.weight[1] * v[di] + b.weight[2] * v[-dj] +
                                         b.weight[3] * v[dj] + b.weight[4] * v[-dk] + b.weight[5] * v[dk];
                            }
                            const float step = factor * (wanted - *v);
                            *v += step;
                            change = std::max(change, double(std::abs(step)));
                        }
                return change;
            },
            [](double a, double b) { return std::max(a, b); });
    }

    const Lattice& lattice_;
    const RunContext& run_;
    std::vector<std::int32_t> entry_;  // index of each node in equations_, or -1
    std::vector<NodeEquation> equations_;
};

WorldBox box_of(const std::vector<Section>& sections) {
    std::vector<Vec3> places;
    for (const Section& section : sections)
        for (const Polygon& polygon : section.polygons)
            for (const Vec2& p : polygon) places.push_back(section.plane.world(p));
    return bounding_box(places);
}

/// Area of the part of the plane in the box, counted on a grid.
double area_within(const SectionPlane& plane, const WorldBox& box) {
    constexpr int kAlong = 64;
    // Project along the axis closest to the normal.
    int a = 0;
    for (int b = 1; b < 3; ++b)
        if (std::abs(plane.normal[b]) > std::abs(plane.normal[a])) a = b;
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    int within = 0;
    for (int j = 0; j < kAlong; ++j)
        for (int k = 0; k < kAlong; ++k) {
            Vec3 at = box.min;
            at[b] += (j + 0.5) / kAlong * (box.max[b] - box.min[b]);
            at[c] += (k + 0.5) / kAlong * (box.max[c] - box.min[c]);
            at[a] -= plane.height(at) / plane.normal[a];
            within += at[a] >= box.min[a] && at[a] <= box.max[a];
        }
    return within / double(kAlong * kAlong) * (box.max[b] - box.min[b]) * (box.max[c] - box.min[c]) /
           std::abs(plane.normal[a]);
}

struct Field {
    Lattice lattice;
    std::vector<float> values;
};

/// Solves on successively finer lattices, down to the cell size `finest`.
/// @param across  the planes' distance, world units
Field solve_between(const Planes& planes, const WorldBox& box, double finest, double across, const RunContext& run) {
    double cell = finest;
    while (longest_side(box) > kCoarsest * cell) cell *= 2;
    Field field;
    for (bool is_first = true; cell >= finest; cell /= 2, is_first = false) {
        Field finer{lattice_of(box, cell), {}};
        const Lattice& lattice = finer.lattice;
        finer.values.assign(lattice.count(), 1.0F);
        if (!is_first)
            tbb::parallel_for(1, lattice.size[0] - 1, [&](int i) {
                const auto stride = lattice.strides();
                for (int j = 1; j + 1 < lattice.size[1]; ++j)
                    for (int k = 1; k + 1 < lattice.size[2]; ++k)
                        finer.values[std::size_t(i * stride[0] + j * stride[1] + k)] = float(trilinear(
                            field.values, field.lattice, plus(lattice.low, cell, {double(i), double(j), double(k)})));
            });
        Solver(planes, lattice, run).solve(finer.values, across / cell);
        field = std::move(finer);
    }
    return field;
}

/// The level that best separates inside from outside in held-out planes; 0 if there are fewer than kFolds planes.
float cross_validated_level(const Planes& planes, const WorldBox& box, double cell, double across,
                            const RunContext& run) {
    if (planes.size() < kFolds) return 0;
    std::vector<std::pair<float, bool>> found;  // value, whether it is inside
    for (std::size_t fold = 0; fold < kFolds; ++fold) {
        Planes kept;
        for (std::size_t n = 0; n < planes.size(); ++n)
            if (n % kFolds != fold) kept.push_back(planes[n]);
        const Field field = solve_between(kept, box, cell, across, run);
        for (std::size_t n = fold; n < planes.size(); n += kFolds) {
            const SectionLevels& plane = *planes[n];
            const int stride = std::max(1, int(cell / plane.grid.cell));
            for (int j = 0; j < plane.grid.ny; j += stride)
                for (int i = 0; i < plane.grid.nx; i += stride) {
                    const Vec2 at{plane.grid.origin[0] + i * plane.grid.cell,
                                  plane.grid.origin[1] + j * plane.grid.cell};
                    const float level = plane.level[std::size_t(j) * std::size_t(plane.grid.nx) + std::size_t(i)];
                    found.emplace_back(float(trilinear(field.values, field.lattice, plane.plane.world(at))), level < 0);
                }
        }
    }
    std::sort(found.begin(), found.end());
    // Number of errors for a level: positions outside with a value at or below it, and positions inside with a value
    // above it. The level increases from below all values.
    auto wrong = std::ptrdiff_t(std::count_if(found.begin(), found.end(), [](const auto& f) { return f.second; }));
    std::ptrdiff_t fewest = wrong;
    float best = 0;
    for (const auto& [value, is_inside] : found) {
        wrong += is_inside ? -1 : 1;
        if (std::abs(value) < 1 && wrong < fewest) {
            fewest = wrong;
            best = value;
        }
    }
    return best;
}

}  // namespace

SectionField::SectionField(const std::vector<Section>& sections, double h, const Vec3& origin, const RunContext& run) {
    WorldBox box = box_of(sections);
    double volume = 1, area = 0;
    for (int a = 0; a < 3; ++a) volume *= box.max[a] - box.min[a];
    for (const Section& section : sections) area += area_within(section.plane, box);
    plane_distance_ = area > 0 ? volume / area : longest_side(box);
    // The box extends beyond the sections by the planes' distance, and its border is outside. It thus has the effect of
    // a further plane without contours, and the body ends about halfway before it.
    double nodes = 1;
    for (int a = 0; a < 3; ++a) {
        box.min[a] = origin[a] + h * std::floor((box.min[a] - plane_distance_ - origin[a]) / h);
        box.max[a] += plane_distance_;
        nodes *= (box.max[a] - box.min[a]) / h + 2;
    }
    // Estimated number of crossings: a plane crosses up to sqrt(3) edges for each node of a layer of the lattice, and
    // each crossing is listed at both ends of its edge.
    const double stops = 2 * std::sqrt(3.0) * double(sections.size()) * std::pow(nodes, 2.0 / 3);
    cell_ =
        h * std::ceil(std::max({1.0, std::cbrt(nodes / double(kMaxFieldNodes)), std::sqrt(stops / double(kMaxStops))}));
    std::vector<SectionLevels> levels(sections.size());
    tbb::parallel_for(std::size_t(0), levels.size(), [&](std::size_t n) { levels[n] = levels_of(sections[n], cell_); });
    run.check();
    Planes planes;
    for (const SectionLevels& plane : levels) planes.push_back(&plane);
    Field field = solve_between(planes, box, cell_, plane_distance_, run);
    const float level = cross_validated_level(planes, box, 2 * cell_, plane_distance_, run);
    for (float& value : field.values) value -= level;
    low_ = field.lattice.low;
    size_ = field.lattice.size;
    values_ = std::move(field.values);
}

double SectionField::value(const Vec3& at) const { return trilinear(values_, {low_, cell_, size_}, at); }

void SectionField::row(const Vec3& from, const Vec3& step, int count, double* values) const {
    for (int n = 0; n < count; ++n) values[n] = value(plus(from, n, step));
}

}  // namespace covol::detail
