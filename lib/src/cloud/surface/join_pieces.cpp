#include "cloud/surface/join_pieces.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "base/disjoint_sets.h"
#include "base/geometry.h"
#include "base/heuristics.h"
#include "base/median.h"
#include "cloud/surface/heuristics.h"
#include "covol/mesh.h"
#include "covol/surface.h"
#include "mesh/triangle.h"
#include "points/kd_tree.h"
#include "points/point_cells.h"

namespace covol::cloud {
namespace {

struct Gap {
    double length = std::numeric_limits<double>::infinity();
    Vec3 from{}, to{};
};

struct Piece {
    std::vector<Vec3> surface;
    double volume = 0;  ///< negative for a cavity
    Gap gap;            ///< shortest gap to a piece to which it may be joined
    /// Updates `gap` if `other` is nearer.
    /// @param maximum  maximum length of a gap
    void find_gap(const detail::KdTree& other, double maximum) {
        for (const Vec3& v : surface)
            if (const Vec3* near = other.nearest_within(v, std::min(gap.length, maximum)))
                gap = {std::sqrt(detail::squared_distance(*near, v)), v, *near};
    }
};

/// The pieces of a mesh except cavities, the largest first.
std::vector<Piece> pieces_of(const TriangleMesh& mesh) {
    detail::DisjointSets joined(mesh.vertices.size());
    for (const auto& t : mesh.triangles)
        for (const std::uint32_t v : {t[1], t[2]}) joined.unite(v, t[0]);
    std::map<std::uint32_t, Piece> pieces;
    for (std::uint32_t v = 0; v < joined.size(); ++v) pieces[joined.root(v)].surface.push_back(mesh.place(v));
    for (const auto& t : mesh.triangles) {
        Piece& piece = pieces[joined.root(t[0])];
        const auto corner = [&](std::size_t n) { return minus(mesh.place(t[n]), piece.surface.front()); };
        piece.volume += dot(corner(0), cross(corner(1), corner(2))) / 6;
    }
    std::vector<Piece> solid;
    for (auto& [number, piece] : pieces)
        if (piece.volume > 0) solid.push_back(std::move(piece));
    std::stable_sort(solid.begin(), solid.end(), [](const Piece& a, const Piece& b) { return a.volume > b.volume; });
    return solid;
}

/// The first piece that is small compared with the largest. @param pieces  the largest first
std::vector<Piece>::iterator first_small_of(std::vector<Piece>& pieces) {
    return std::find_if(pieces.begin(), pieces.end(),
                        [&](const Piece& p) { return p.volume < kCommon.minority * pieces.front().volume; });
}

/// Squared distance from the gap's segment.
double squared_from(const Gap& gap, const Vec3& place) {
    const Vec3 along = minus(gap.to, gap.from), to = minus(place, gap.from);
    const double squared = dot(along, along), t = squared > 0 ? std::clamp(dot(to, along) / squared, 0.0, 1.0) : 0;
    const Vec3 off = minus(to, times(t, along));
    return dot(off, off);
}

WorldBox box_around(const Gap& gap, double reach) {
    WorldBox box;
    for (int a = 0; a < 3; ++a) {
        box.min[a] = std::min(gap.from[a], gap.to[a]) - reach;
        box.max[a] = std::max(gap.from[a], gap.to[a]) + reach;
    }
    return box;
}

/// Adds a rod with round ends along the gap to the solid.
void fill(FloatGrid& level_set, const Gap& gap, double radius) {
    const Domain domain = domain_of(level_set);
    const WorldBox box = box_around(gap, radius + domain.voxel_size);
    const Vec3 low = domain.world_to_index(box.min), high = domain.world_to_index(box.max);
    auto values = level_set.getAccessor();
    for (int i = int(std::floor(low[0])); i <= high[0]; ++i)
        for (int j = int(std::floor(low[1])); j <= high[1]; ++j)
            for (int k = int(std::floor(low[2])); k <= high[2]; ++k) {
                const double distance =
                    std::sqrt(squared_from(gap, domain.index_to_world({double(i), double(j), double(k)}))) - radius;
                const openvdb::Coord at(i, j, k);
                if (distance < double(values.getValue(at))) values.setValueOn(at, float(distance));
            }
}

}  // namespace

std::size_t count_large_pieces(const FloatGrid& level_set, const RunContext& run) {
    std::vector<Piece> pieces = pieces_of(extract_mesh(level_set, {}, run));
    return std::size_t(first_small_of(pieces) - pieces.begin());
}

std::size_t join_pieces(FloatGrid& level_set, const std::vector<Vec3>& points, double apart, const RunContext& run) {
    std::vector<Piece> pieces = pieces_of(extract_mesh(level_set, {}, run));
    const auto first_small = first_small_of(pieces);
    if (first_small == pieces.end()) return 0;
    std::vector<Vec3> large;
    for (auto piece = pieces.begin(); piece != first_small; ++piece)
        large.insert(large.end(), piece->surface.begin(), piece->surface.end());
    std::vector<Piece> small(std::make_move_iterator(first_small), std::make_move_iterator(pieces.end()));
    const detail::KdTree whole(std::move(large));
    const double max_gap = kJoin.max_gap * apart;
    for (Piece& piece : small) piece.find_gap(whole, max_gap);

    const double voxel = domain_of(level_set).voxel_size;
    const PointCells cells(points, apart);
    std::vector<PointCells::Range> ranges;
    // Without points all along the gap, the surface really ends at it.
    const auto has_points_along = [&](const Gap& gap) {
        const int steps = 1 + int(2 * gap.length / voxel);
        for (int n = 0; n <= steps; ++n)
            if (!cells.any_within(plus(gap.from, times(double(n) / steps, minus(gap.to, gap.from))), apart))
                return false;
        return true;
    };
    std::size_t joined = 0;
    while (!small.empty()) {
        run.check();
        const auto next = std::min_element(small.begin(), small.end(),
                                           [](const Piece& a, const Piece& b) { return a.gap.length < b.gap.length; });
        const Gap gap = next->gap;
        if (!(gap.length < max_gap)) break;
        if (!has_points_along(gap)) {
            next->gap = {};  // remains separate, unless a small piece near it is joined later
            continue;
        }
        std::vector<double> around;
        cells.find(box_around(gap, apart), ranges);
        for (const PointCells::Range& range : ranges)
            for (std::uint32_t n = range.begin; n < range.end; ++n)
                if (const double off = std::sqrt(squared_from(gap, cells.sorted()[n])); off < apart)
                    around.push_back(off);
        // Only parts thinner than the distance between points are torn off, so the rod needs no larger radius.
        fill(level_set, gap, std::max(std::min(median(std::move(around)), 0.5 * apart), voxel));
        ++joined;
        const detail::KdTree own(std::move(next->surface));
        small.erase(next);
        for (Piece& piece : small) piece.find_gap(own, max_gap);
    }
    return joined;
}

}  // namespace covol::cloud
