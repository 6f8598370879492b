#include "points/parts.h"

#include <algorithm>
#include <utility>

#include "base/disjoint_sets.h"
#include "base/heuristics.h"
#include "covol/points.h"
#include "points/point_cells.h"

namespace covol::cloud {
namespace {

/// The points of the part with the longest side. Cells that are adjacent belong to the same part.
std::vector<Vec3> largest_of(const PointCells& cells) {
    const std::size_t count = cells.cell_count();
    std::vector<std::uint32_t> cell_of(cells.sorted().size());
    for (std::uint32_t n = 0; n < count; ++n)
        std::fill(cell_of.begin() + cells.cell(n).begin, cell_of.begin() + cells.cell(n).end, n);
    detail::DisjointSets parts(count);
    std::vector<PointCells::Range> ranges;
    for (std::uint32_t n = 0; n < count; ++n) {
        cells.find(cells.sorted()[cells.cell(n).begin], cells.edge(), ranges);
        for (const PointCells::Range& range : ranges)
            for (std::uint32_t at = range.begin; at < range.end; at = cells.cell(cell_of[at]).end)
                parts.unite(n, cell_of[at]);
    }
    std::vector<std::vector<Vec3>> grouped(count);
    for (std::size_t n = 0; n < cell_of.size(); ++n) grouped[parts.root(cell_of[n])].push_back(cells.sorted()[n]);
    double longest = -1;
    std::size_t largest = 0;
    for (std::size_t n = 0; n < count; ++n) {
        if (grouped[n].empty()) continue;
        const double side = longest_side(bounding_box(grouped[n]));
        if (side > longest) longest = side, largest = n;
    }
    return std::move(grouped[largest]);
}

struct LargestPart {
    std::vector<Vec3> points;  ///< none if the cloud is in one part
    double side = 0;           ///< longest side of the part's bounding box, world units
};

LargestPart find_largest_part(const std::vector<Vec3>& all, double resolution, double edge) {
    LargestPart part{{}, longest_side(bounding_box(all))};
    while (part.side > resolution * edge) {
        std::vector<Vec3> next =
            largest_of(PointCells(part.points.empty() ? all : part.points, part.side / resolution));
        const double longest = longest_side(bounding_box(next));
        if (kCommon.clear_ratio * longest > part.side) break;
        part = {std::move(next), longest};
    }
    return part;
}

}  // namespace

double largest_part_side(const std::vector<Vec3>& points, double resolution, double edge) {
    return find_largest_part(points, resolution, edge).side;
}

std::vector<Vec3> largest_part(const std::vector<Vec3>& points, double resolution, double edge) {
    LargestPart part = find_largest_part(points, resolution, edge);
    return part.points.empty() ? points : std::move(part.points);
}

}  // namespace covol::cloud
