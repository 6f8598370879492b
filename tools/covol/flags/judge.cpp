#include "flags/judge.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Morphology.h>

#include "covol/domain.h"
#include "covol/edge.h"

namespace covol::tool {
namespace {

constexpr double kReachVoxels = 5.0;  // of marks whose attraction is unlimited
constexpr double kWeakLine = 0.93;    // 1 - g where the image is 1.2 times as bright as the band's median
constexpr int kBesideBand = 5;        // voxels beside the surface's band that tell how steep slopes are here

/// Where edges are looked up for a surface that was found without them.
FloatGridPtr around(const FloatGrid& surface) {
    FloatGridPtr topology = surface.deepCopy();
    openvdb::tools::dilateActiveValues(topology->tree(), kBesideBand, openvdb::tools::NN_FACE,
                                       openvdb::tools::EXPAND_TILES);
    const Domain domain = domain_of(surface);
    topology->clip({openvdb::Coord(domain.min.data()), openvdb::Coord(domain.max.data())});
    return topology;
}

}  // namespace

Evidence judge(const SegmentResult& result, const std::vector<Vec3>& marks, const Image& image, int suggestions,
               const RunContext& run) {
    const SegmentOptions& used = result.report.resolved;
    EvidenceOptions options;
    const double range = used.evolve.attraction_range.value_or(0);
    options.reach = range > 0 ? range : kReachVoxels * *used.voxel_size;
    options.suggestions = suggestions;
    // Brightness is nowhere 0 as slopes are, and g falls below 1/2 before there is a line.
    if (is_line(used.edge.feature)) options.weak_edge = kWeakLine;
    // Edges that moved nothing were not looked for.
    const FloatGridPtr g =
        result.edge ? result.edge : detect_edges(image, *around(*result.surface), used.edge, run).grid;
    return assess_evidence(result.mesh, marks, *g, image.geometry(), options, run);
}

}  // namespace covol::tool
