#include "segment/solve/fields.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Morphology.h>

#include <algorithm>
#include <cmath>

#include "base/heuristics.h"
#include "covol/distance.h"
#include "distance/memory_need.h"

namespace covol::pipeline {
namespace {

/// Distance in voxels that a band which follows the surface may move before g is extended.
int edge_reach(StartOrigin origin) {
    switch (origin) {
        case StartOrigin::Guess:
        case StartOrigin::Contours: return 5;     // these starts lie close to the result
        case StartOrigin::CoarseLevel: return 4;  // the result of a coarser level lies closer still
        default: return 12;
    }
}

/// The active voxels of u and all within `voxels` of them, inside the domain; values are undefined.
FloatGridPtr dilated_topology(const FloatGrid& u, int voxels, const Domain& domain) {
    FloatGridPtr topology = u.deepCopy();
    openvdb::tools::dilateActiveValues(topology->tree(), voxels, openvdb::tools::NN_FACE, openvdb::tools::EXPAND_TILES);
    topology->clip({openvdb::Coord(domain.min.data()), openvdb::Coord(domain.max.data())});
    return topology;
}

/// Whether every active voxel of u is active in `field`.
bool covers(const FloatGrid& field, const FloatGrid& u) {
    for (auto leaf = u.tree().cbeginLeaf(); leaf; ++leaf) {
        const auto* known = field.tree().probeConstLeaf(leaf->origin());
        auto missing = leaf->valueMask();
        if (known != nullptr) missing -= known->valueMask();
        if (!missing.isOff()) return false;
    }
    return true;
}

/// The length of the diagonal of the box around both boxes.
double diagonal(const WorldBox& a, const WorldBox& b) {
    double squares = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = std::max(a.max[axis], b.max[axis]) - std::min(a.min[axis], b.min[axis]);
        squares += side * side;
    }
    return std::sqrt(squares);
}

/// Central differences of the body's level over the length h along each axis, which are not divided by h: only the
/// direction of the gradient is used.
Vec3 gradient(const ContourSolid& body, const Vec3& at, double h) {
    Vec3 slope;
    for (int a = 0; a < 3; ++a) {
        Vec3 low = at, high = at;
        low[a] -= 0.5 * h;
        high[a] += 0.5 * h;
        slope[a] = body.level(high) - body.level(low);
    }
    return slope;
}

/// A distance from `minimum` to `reach`, as large as possible, such that for most marks the position at this distance
/// from the mark along the inward normal lies inside the body. At larger distances, it would lie beyond the opposite
/// side of a thin body.
double reach_within(const ContourSolid& body, const std::vector<Vec3>& places, const std::vector<Vec3>& normals,
                    double reach, double minimum) {
    for (; reach > minimum; reach *= 0.75) {
        std::size_t inside = 0;
        for (std::size_t n = 0; n < places.size(); ++n) {
            Vec3 side = places[n];
            for (int a = 0; a < 3; ++a) side[a] -= reach * normals[n][a];
            inside += body.level(side) < -0.5 * reach;  // inside, and at least half of `reach` from the surface
        }
        if (2 * inside > places.size()) return reach;
    }
    return minimum;
}

}  // namespace

FloatGridPtr find_distance(const std::vector<Vec3>& points, const Domain& domain, double radius, double reach,
                           StepReport& report, const RunContext& run) {
    const Timed timed(report.seconds.distance);
    detail::require_tube_memory(points, domain, {reach, (radius - reach) / domain.voxel_size, true}, "segment", run);
    RunContext checked = run;
    checked.memory_budget = 0;  // so that compute_distance() does not estimate the memory again
    return compute_distance(points, domain, {radius}, checked).grid;
}

FloatGridPtr find_distance_for_flow(const StartFacts& start, const FloatGrid& u, StepReport& report,
                                    const RunContext& run) {
    if (!uses_points(start.flow)) return nullptr;
    const std::vector<Vec3>& points = start.marks.attracting;
    const double h = start.domain.voxel_size, slack = band_slack(h);
    if (const double range = start.flow.attraction_range.value_or(0); range > 0)
        return find_distance(points, start.domain, range + slack, 0, report, run);
    const WorldBox all = start.domain.world_box();
    // d is computed with one voxel for each leaf of u, and read at one position in each leaf.
    const double coarse_h = double(FloatGrid::TreeType::LeafNodeType::DIM) * h;
    const Domain coarse = make_domain(all, coarse_h);
    const FloatGridPtr d = compute_distance(points, coarse, {diagonal(all, bounding_box(points))}, run).grid;
    double largest = 0;
    const auto d_at = d->getConstAccessor();
    for (auto leaf = u.tree().cbeginLeaf(); leaf; ++leaf) {
        const openvdb::Coord center = leaf->origin().offsetBy(4);
        const openvdb::Vec3d where = d->worldToIndex(u.indexToWorld(center));
        largest = std::max(largest, double(d_at.getValue(openvdb::Coord::round(where))));
    }
    const double radius = largest + coarse_h + slack;
    report.remarks.choose("distance_tube", number(radius), "the attraction is unlimited: the tube extends to the start",
                          run);
    return find_distance(points, start.domain, radius, 0, report, run);
}

FloatGridPtr find_trusted_distance(const Problem& problem, const StartFacts& start, StepReport& report) {
    const double range = start.flow.attraction_range.value_or(0);
    if (!problem.options.contours || !uses_points(start.flow) || !uses_image(start.flow) || range <= 0) return nullptr;
    const Timed timed(report.seconds.distance);
    return compute_distance(start.marks.trusted, start.domain, {range + kTubeSlackVoxels * start.domain.voxel_size},
                            problem.run)
        .grid;
}

EdgeChoice choose_edge_feature(const Problem& problem, const Choices& choices) {
    EdgeChoice choice{choices.edge, {}};
    const ContourSolid* body = problem.body();
    if (!uses_image(choices.evolve) || choices.edge.feature != EdgeFeature::Automatic || body == nullptr) return choice;
    std::vector<Vec3> places, normals;
    const std::vector<Vec3>& along = problem.options.contours->along;
    const std::size_t stride = 1 + along.size() / kCommon.sample;
    for (std::size_t n = 0; n < along.size(); n += stride) {
        Vec3 normal = gradient(*body, along[n], choices.h);
        const double length = std::hypot(normal[0], normal[1], normal[2]);
        if (!(length > 0)) continue;
        for (double& component : normal) component /= length;
        places.push_back(along[n]);
        normals.push_back(normal);
    }
    // Farther from a mark than three standard deviations of the smoothing, the values at the mark hardly affect the
    // smoothed image.
    const double reach =
        reach_within(*body, places, normals, 3 * std::max(choices.edge.sigma.value_or(0), choices.h), choices.h);
    const MarkedFeature found = detect_feature(*problem.image, places, normals, reach);
    choice.options.feature = found.feature;
    const std::string line = "at the marks the image is " + number(std::abs(found.line)) +
                             (found.line > 0 ? " brighter" : " darker") + " than on both sides, which differ by " +
                             number(2 * std::abs(found.step));
    choice.report.remarks.choose("edge_feature", to_string(found.feature),
                                 is_line(found.feature) ? line : "no line runs along the marks", problem.run);
    return choice;
}

Edges find_edges(const Problem& problem, const StartFacts& start, const FloatGrid& u, const EdgeOptions& options) {
    Edges edges;
    edges.options = options;
    if (!uses_image(start.flow)) return edges;
    const Timed timed(edges.report.seconds.edge);
    const FloatGridPtr topology_of_band =
        start.flow.follow ? dilated_topology(u, edge_reach(start.origin), start.domain) : nullptr;
    const EdgeResult found =
        detect_edges(*problem.image, topology_of_band ? *topology_of_band : u, options, problem.run);
    edges.grid = found.grid;
    edges.found = found.report;
    const EdgeReport& e = found.report;
    Remarks& remarks = edges.report.remarks;
    if (!options.edge_k && !options.edge_contrast)
        remarks.choose("edge_k", number(e.edge_k),
                       std::string("g = 1/2 at a ") + (is_line(e.feature) ? "brightness" : "gradient") + " of " +
                           number(e.edge_contrast),
                       problem.run);
    if (!options.intensities)
        remarks.choose("intensities", number(e.low) + " to " + number(e.high),
                       "percentiles near the band, mapped to 0 and 1", problem.run);
    // These settings are fixed from here on, because g must keep its meaning while the band moves.
    edges.options.feature = e.feature;
    edges.options.edge_k = e.edge_k;
    edges.options.edge_contrast.reset();
    edges.options.intensities = {e.low, e.high};
    return edges;
}

FloatGridPtr extended_edges(const Problem& problem, const StartFacts& start, const FloatGrid& u, const Edges& edges) {
    if (covers(*edges.grid, u)) return nullptr;
    const FloatGridPtr topology_of_band = dilated_topology(u, edge_reach(start.origin), start.domain);
    return detect_edges(*problem.image, *topology_of_band, edges.options, problem.run).grid;
}

}  // namespace covol::pipeline
