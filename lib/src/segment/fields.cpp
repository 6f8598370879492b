#include "segment/fields.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Morphology.h>

#include <algorithm>
#include <cmath>

#include "covol/distance.h"
#include "distance/memory_need.h"
#include "segment/heuristics.h"

namespace covol::pipeline {
namespace {

/// A band that follows moves this far, in voxels, before g is extended.
int edge_reach(StartOrigin origin) {
    switch (origin) {
        case StartOrigin::Guess:
        case StartOrigin::Contours: return 5;     // lies close to the end
        case StartOrigin::CoarseLevel: return 4;  // closer still
        default: return 12;
    }
}

/// The active voxels of u and all within `voxels` of them, inside the domain; values mean nothing.
FloatGridPtr dilated_topology(const FloatGrid& u, int voxels, const Domain& domain) {
    FloatGridPtr topology = u.deepCopy();
    openvdb::tools::dilateActiveValues(topology->tree(), voxels, openvdb::tools::NN_FACE, openvdb::tools::EXPAND_TILES);
    topology->clip({openvdb::Coord(domain.min.data()), openvdb::Coord(domain.max.data())});
    return topology;
}

/// Every active voxel of u is active in `field`.
bool covers(const FloatGrid& field, const FloatGrid& u) {
    for (auto leaf = u.tree().cbeginLeaf(); leaf; ++leaf) {
        const auto* known = field.tree().probeConstLeaf(leaf->origin());
        auto missing = leaf->valueMask();
        if (known != nullptr) missing -= known->valueMask();
        if (!missing.isOff()) return false;
    }
    return true;
}

/// The length of the diagonal of the box around both.
double diagonal(const WorldBox& a, const WorldBox& b) {
    double squares = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = std::max(a.max[axis], b.max[axis]) - std::min(a.min[axis], b.min[axis]);
        squares += side * side;
    }
    return std::sqrt(squares);
}

/// Of the body, by central differences over h, not normalised.
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

/// How far beside the marks a side is that is still inside: across a thin body the other wall would be taken for it.
double reach_within(const ContourSolid& body, const std::vector<Vec3>& places, const std::vector<Vec3>& normals,
                    double reach, double least) {
    for (; reach > least; reach *= 0.75) {
        std::size_t inside = 0;
        for (std::size_t n = 0; n < places.size(); ++n) {
            Vec3 side = places[n];
            for (int a = 0; a < 3; ++a) side[a] -= reach * normals[n][a];
            inside += body.level(side) < -kFields.side_depth * reach;
        }
        if (2 * inside > places.size()) return reach;
    }
    return least;
}

}  // namespace

void find_distance(Job& job, double radius, double reach) {
    Timed timed(job.report().seconds.distance);
    detail::require_tube_memory(job.points, job.domain(), {reach, (radius - reach) / job.h(), true}, "segment",
                                job.run);
    RunContext checked = job.run;
    checked.memory_budget = 0;  // compute_distance() need not estimate it again
    job.result.distance = compute_distance(job.points, job.domain(), {radius}, checked).grid;
}

double tube_for_start(Job& job) {
    const double slack = band_slack(job);
    if (job.attraction_range() > 0) return job.attraction_range() + slack;
    const WorldBox all = job.domain().world_box();
    const Domain coarse = make_domain(all, kFields.coarse_factor * job.h());
    const FloatGridPtr d =
        compute_distance(job.points, coarse, {diagonal(all, bounding_box(job.points))}, job.run).grid;
    double largest = 0;
    const auto d_at = d->getConstAccessor();
    for (auto leaf = job.result.u->tree().cbeginLeaf(); leaf; ++leaf) {
        const openvdb::Coord center = leaf->origin().offsetBy(4);
        const openvdb::Vec3d where = d->worldToIndex(job.result.u->indexToWorld(center));
        largest = std::max(largest, double(d_at.getValue(openvdb::Coord::round(where))));
    }
    const double radius = largest + kFields.coarse_factor * job.h() + slack;
    job.choose("distance_tube", number(radius), "the attraction is unlimited: it covers the way from the start");
    return radius;
}

void compute_trusted_distance(Job& job) {
    const double range = job.attraction_range();
    if (job.rests() || !job.options.contours || !job.uses_points() || !job.uses_image() || range <= 0) return;
    Timed timed(job.report().seconds.distance);
    job.trusted_distance =
        compute_distance(job.trusted, job.domain(), {range + kTubeSlackVoxels * job.h()}, job.run).grid;
}

void choose_edge_feature(Job& job) {
    EdgeOptions& edge = job.options.edge;
    if (!job.uses_image() || edge.feature != EdgeFeature::Automatic || job.body() == nullptr) return;
    std::vector<Vec3> places, normals;
    const std::vector<Vec3>& along = job.options.contours->along;
    const std::size_t stride = 1 + along.size() / kFields.feature_marks;
    for (std::size_t n = 0; n < along.size(); n += stride) {
        Vec3 normal = gradient(*job.body(), along[n], job.h());
        const double length = std::hypot(normal[0], normal[1], normal[2]);
        if (!(length > 0)) continue;
        for (double& component : normal) component /= length;
        places.push_back(along[n]);
        normals.push_back(normal);
    }
    const double reach = reach_within(*job.body(), places, normals,
                                      kFields.sides_sigmas * std::max(edge.sigma.value_or(0), job.h()), job.h());
    const MarkedFeature found = detect_feature(*job.image, places, normals, reach);
    edge.feature = found.feature;
    const std::string line = "at the marks the image is " + number(std::abs(found.line)) +
                             (found.line > 0 ? " brighter" : " darker") + " than on both sides, which differ by " +
                             number(2 * std::abs(found.step));
    job.choose("edge_feature", to_string(found.feature),
               found.feature != EdgeFeature::Slope ? line : "no line runs along the marks");
}

void find_edges(Job& job) {
    if (!job.uses_image()) return;
    Timed timed(job.report().seconds.edge);
    const FloatGridPtr reach = job.options.evolve.follow
                                   ? dilated_topology(*job.result.u, edge_reach(job.origin), job.domain())
                                   : job.result.u;
    EdgeOptions& options = job.options.edge;
    EdgeResult found = detect_edges(*job.image, *reach, options, job.run);
    job.result.edge = found.grid;
    job.report().edge = found.report;
    const EdgeReport& e = found.report;
    if (!options.edge_k && !options.edge_contrast) {
        const char* measure = options.feature <= EdgeFeature::Slope ? "gradient" : "brightness";
        job.choose("edge_k", number(e.edge_k),
                   std::string("g = 1/2 at a ") + measure + " of " + number(e.edge_contrast));
    }
    if (options.low == options.high)
        job.choose("intensities", number(e.low) + " to " + number(e.high), "mapped to 0 and 1, percentiles");
    // Fixed from here on: a band that moves must not change the meaning of g.
    options.edge_k = e.edge_k;
    options.edge_contrast.reset();
    options.low = e.low;
    options.high = e.high;
}

void extend_edges(Job& job, const FloatGrid& u, EvolveFields& fields) {
    if (fields.edge == nullptr || covers(*fields.edge, u)) return;
    Timed timed(job.report().seconds.edge);
    const FloatGridPtr reach = dilated_topology(u, edge_reach(job.origin), job.domain());
    job.result.edge = detect_edges(*job.image, *reach, job.options.edge, job.run).grid;
    fields.edge = job.result.edge.get();
}

}  // namespace covol::pipeline
