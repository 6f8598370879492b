#include "cloud/orientation/layers.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/indicator/indicator.h"
#include "cloud/orientation/heuristics.h"
#include "points/point_cells.h"

namespace covol::cloud {
namespace {

using Patch = std::vector<std::uint32_t>;  // indices of points

/// Maximum distance between positions in two cells that share a face: the diagonal of both.
double adjacent_within(double edge) { return std::sqrt(6.0) * edge; }

/// Finds the cells whose mean free direction (free_directions()) forms an angle of more than 90 degrees with the sum of
/// the mean free directions of the adjacent cells.
class Opposed {
public:
    Opposed(const PointCells& cells, const std::vector<Vec3>& free)
        : cells_(cells), opposed_(cells.cell_count()), beside_(cells.cell_count()) {
        std::vector<Vec3> places, frees;
        for (std::size_t c = 0; c < cells.cell_count(); ++c) {
            places.push_back(cells.sorted()[cells.cell(c).begin]);
            frees.push_back(free[cells.order()[cells.cell(c).begin]]);  // that of the cell's first point
        }
        const PointCells near(places, cells.edge());
        const double reach = adjacent_within(cells.edge());
        tbb::parallel_for(std::size_t(0), places.size(), [&](std::size_t c) {
            std::vector<PointCells::Range> ranges;
            const Vec3& p = places[c];
            near.find(p, reach, ranges);
            Vec3 sum{0, 0, 0};
            for (const PointCells::Range& range : ranges)
                for (std::uint32_t at = range.begin; at < range.end; ++at) {
                    const Vec3 to = minus(near.sorted()[at], p);
                    const double squared = dot(to, to);
                    if (squared > reach * reach) continue;
                    sum = plus(sum, frees[near.order()[at]]);
                    beside_[c].push_back(near.order()[at]);
                }
            opposed_[c] = dot(sum, frees[c]) < 0;
        });
    }

    /// The points of each connected group of opposed cells, the largest group first.
    [[nodiscard]] std::vector<Patch> patches() const {
        std::vector<Patch> all;
        std::vector<char> seen(opposed_.size(), 0);
        for (std::uint32_t first = 0; first < opposed_.size(); ++first) {
            if (!opposed_[first] || seen[first]) continue;
            std::vector<std::uint32_t> connected{first};
            seen[first] = 1;
            for (std::size_t n = 0; n < connected.size(); ++n)
                for (const std::uint32_t next : beside_[connected[n]])
                    if (opposed_[next] && !seen[next]) {
                        seen[next] = 1;
                        connected.push_back(next);
                    }
            Patch& patch = all.emplace_back();
            for (const std::uint32_t c : connected)
                for (std::uint32_t at = cells_.cell(c).begin; at < cells_.cell(c).end; ++at)
                    patch.push_back(cells_.order()[at]);
        }
        std::stable_sort(all.begin(), all.end(), [](const Patch& a, const Patch& b) { return a.size() > b.size(); });
        return all;
    }

private:
    const PointCells& cells_;
    std::vector<char> opposed_;
    std::vector<std::vector<std::uint32_t>> beside_;
};

/// The cells that the indicator's surface crosses, and the area of those without points.
struct Level {
    Level(const WindingField& field, const PointCells& points) {
        const double cell = field.indicator().stack().cell(), reach = kCloud.coarse * cell;
        make_indicator(field)->crossed([&](const WorldBox& box) {
            middles.push_back(times(0.5, plus(box.min, box.max)));
            const double side = (box.max[0] - box.min[0]) / cell;
            if (!points.any_within(middles.back(), reach)) bare += side * side;
        });
    }
    std::vector<Vec3> middles;  // centres of the cells crossed by the surface
    double bare = 0;            // area without points, in units of a face of the finest cells
};

void turn(const Patch& patch, Orientation& orientation) {
    for (const std::uint32_t n : patch) orientation.normals[n] = times(-1, orientation.normals[n]);
}

}  // namespace

std::vector<char> turn_layers(WindingField& field, const std::vector<Vec3>& points, const std::vector<Vec3>& free,
                              double between, Orientation& orientation, const RunContext& run) {
    std::vector<char> turned(points.size(), 0);
    const PointCells cells(points, kCloud.coarse * between);
    std::vector<Patch> patches = Opposed(cells, free).patches();
    patches.resize(std::min(patches.size(), std::size_t(kLayers.max_patches)));
    const double cell = field.indicator().stack().cell();
    double bare = Level(field, cells).bare;
    for (const Patch& patch : patches) {
        if (patch.size() < kCommon.quadric) break;
        run.check();
        turn(patch, orientation);
        WindingField now(field.indicator().shared_stack());
        solve(now, points, orientation, kCyclesFromNothing, run);
        scale_to_half(now, points);
        const Level level(now, cells);
        const PointCells surface(level.middles, cells.edge());
        const auto away = std::count_if(patch.begin(), patch.end(), [&](std::uint32_t n) {
            return !surface.any_within(points[n], adjacent_within(cells.edge()));
        });
        double area = 0;
        for (const std::uint32_t n : patch) area += orientation.areas[n];
        // If the patch was the near side of a false cavity, which vanishes by the reversal, the area without points
        // decreases by that of the far side, which is not much larger. If the hole of a ring closes, it decreases by
        // much more.
        const double gain = (bare - level.bare) * cell * cell;
        if (!(gain > 0 && gain < kCommon.clear_ratio * area) ||
            double(away) > kCommon.minority * double(patch.size())) {
            turn(patch, orientation);
            continue;
        }
        bare = level.bare;
        field = std::move(now);
        for (const std::uint32_t n : patch) turned[n] = 1;
    }
    return turned;
}

}  // namespace covol::cloud
