#include "covol/cloud_surface.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/ValueTransformer.h>

#include <algorithm>
#include <cmath>

#include "cloud/orientation/indicator.h"
#include "cloud/surface/cloud_field.h"
#include "cloud/surface/heuristics.h"
#include "cloud/surface/hold_topology.h"
#include "cloud/surface/join_pieces.h"
#include "covol/evidence.h"
#include "covol/mesh.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "surface/pieces.h"

namespace covol {
namespace {

/// Pieces, cavities and handles.
struct Complexity {
    Complexity(const FloatGrid& level_set, const RunContext& run) {
        const MeshMeasures m = measure(extract_mesh(level_set, {}, run));
        pieces = m.components;
        all = m.components + std::max(0, m.genus);
    }
    int pieces;  ///< and cavities
    int all;
};

/// Gives a level set the topology of an indicator that has fewer pieces and handles.
struct TopologyOf {
    Complexity own;
    std::size_t least;  // points, on a piece
    const std::vector<Vec3>& points;
    const RunContext& run;

    void hold(FloatGrid& level_set, const Indicator& indicator, CloudReport& report) {
        if (own.all <= 1) return;
        const Domain domain = domain_of(level_set);
        const FloatGridPtr rough = cloud::level_set_of(indicator, domain, run);
        detail::drop_bare_pieces(*rough, points, least);
        const Complexity simpler(*rough, run);
        if (simpler.all >= own.all) return;
        report.held_voxels += cloud::hold_topology(*rough, level_set);
        own = simpler;
    }
};

/// Whether some of the surface is far from all points.
bool is_open(const FloatGrid& level_set, const CloudOrientation& cloud, const RunContext& run) {
    return measure_share_without_points(extract_mesh(level_set, {}, run), cloud.points,
                                        kBlend.far_spacings * cloud.scale.spacing, run) > kBlend.open_share;
}

}  // namespace

void cloud::settle(FloatGrid& field, const CloudOrientation& cloud, CloudReport& report, const RunContext& run) {
    const Orientation& orientation = cloud.orientation;
    const double share = cloud.encloses ? kBlend.least_resting_share : kBlend.least_resting_open,
                 noises = report.noise / report.spacing;
    const auto least =
        std::size_t(std::max({kBlend.least_resting, share * double(cloud.points.size()), 4 * M_PI * noises * noises}));
    report.dropped_pieces = detail::drop_bare_pieces(field, cloud.points, least);
    // Before the indicator's topology is held, for it may have lost torn parts, and after, for it may tear others.
    const auto join = [&] {
        const std::size_t joined = cloud::join_pieces(field, cloud.points, std::max(report.spacing, report.noise), run);
        report.joined_pieces += joined;
        return joined > 0;
    };
    TopologyOf topology{Complexity(field, run), least, cloud.points, run};
    if (topology.own.pieces > 1 && join()) topology.own = Complexity(field, run);
    topology.hold(field, *orientation.indicator, report);
    // Where the points leave gaps, what surrounds a gap makes small handles on a lattice as fine as they are.
    if (topology.own.all > 1 && !orientation.screened && is_open(field, cloud, run))
        topology.hold(field,
                      *cloud::indicator_of(cloud.points, orientation, kBlend.coarse_spacings * cloud.scale.spacing),
                      report);
    if (topology.own.pieces > 1) join();
    const float background = field.background();
    openvdb::tools::foreach (field.tree().beginLeaf(), [background](const FloatGrid::TreeType::LeafIter& leaf) {
        for (auto value = leaf->beginValueOn(); value; ++value)
            if (std::abs(*value) >= background) value.setValueOff();
    });
    openvdb::tools::pruneLevelSet(field.tree());
}

FloatGridPtr cloud::settled_field(const Domain& domain, const CloudOrientation& cloud, CloudReport& report,
                                  const RunContext& run) {
    FloatGridPtr field = cloud::CloudField(cloud, domain.voxel_size, report, run).on(domain, run);
    settle(*field, cloud, report, run);
    return field;
}

FloatGridPtr surface_from_cloud(const Domain& domain, const CloudOrientation& cloud, CloudReport& report,
                                const RunContext& run) {
    FloatGridPtr result;
    with_threads(run,
                 [&] { result = start_from_grid(domain, *cloud::settled_field(domain, cloud, report, run), run); });
    return result;
}

}  // namespace covol
