#include "covol/cloud_surface.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/heuristics.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/indicator/indicator.h"
#include "cloud/surface/cloud_field.h"
#include "cloud/surface/hold_topology.h"
#include "cloud/surface/join_pieces.h"
#include "covol/error.h"
#include "covol/mesh_stream.h"
#include "covol/start.h"
#include "mesh/triangle.h"
#include "points/point_cells.h"
#include "redistance/no_surface.h"
#include "surface/marching_cubes.h"
#include "surface/mesh_pieces.h"
#include "surface/pieces.h"

namespace covol {
namespace {

/// Numbers of pieces and handles of a level set's surface.
struct Complexity {
    Complexity(const FloatGrid& level_set, const RunContext& run) {
        try {
            const MeshMeasures m = measure_surface(level_set, 0, run).measures;
            pieces = m.components;
            all = m.components + std::max(0, m.genus);
        } catch (const NoSurface&) {  // no surface: the counts stay 0
        }
    }
    int pieces = 0;  ///< including cavities
    int all = 0;     ///< pieces, cavities and handles
};

/// Gives a level set the topology of an indicator's surface, but only if that surface has fewer pieces and handles in
/// total than the level set.
struct TopologyOf {
    Complexity own;
    std::size_t minimum;  // pieces with fewer points are removed from the indicator's surface
    const std::vector<Vec3>& points;
    const RunContext& run;

    void hold(FloatGrid& level_set, const Indicator& indicator, CloudReport& report) {
        if (own.all <= 1) return;
        const Domain domain = domain_of(level_set);
        const FloatGridPtr rough = cloud::level_set_of(indicator, domain, run);
        detail::drop_bare_pieces(*rough, points, minimum);
        const Complexity simpler(*rough, run);
        if (simpler.pieces == 0 || simpler.all >= own.all) return;
        // Small pieces may have been torn off, but large ones are bodies that the indicator's cells are too wide to
        // separate.
        if (simpler.pieces < own.pieces &&
            cloud::count_large_pieces(*rough, run) < cloud::count_large_pieces(level_set, run))
            return;
        // If more voxels differ in sign than a layer of one voxel on the surface contains, nothing is changed: the two
        // surfaces may then close a scan of one side in different ways.
        const auto layer = std::size_t(double(level_set.activeVoxelCount()) / (2 * kHalfWidthVoxels));
        report.held_voxels += cloud::hold_topology(*rough, level_set, run, layer);
        own = simpler;
    }
};

/// Whether more than the fraction kCommon.minority of the surface's area is farther from all points than kCloud.coarse
/// spacings, as in gaps between the points.
bool is_open(const FloatGrid& level_set, const CloudOrientation& points, const RunContext& run) {
    constexpr std::uint64_t kTriangles = 100000;  // size of the sample: the fraction is accurate to about 0.001
    const double reach = kCloud.coarse * points.scale.spacing;
    const cloud::PointCells cells(points.points, reach);
    double all = 0, bare = 0;
    detail::measure_pieces(level_set, 0, run, [&](const StreamedMesh& mesh, const detail::MeshPiece& piece) {
        const std::size_t step = std::size_t(1 + mesh.triangles / kTriangles);
        std::vector<double> area((piece.triangles.size() + step - 1) / step);
        std::vector<char> is_bare(area.size());
        tbb::parallel_for(std::size_t(0), area.size(), [&](std::size_t n) {
            std::array<Vec3, 3> corners;
            Vec3 middle = mesh.origin;
            for (std::size_t k = 0; k < 3; ++k) {
                corners[k] = meshing::to_vec3(piece.positions[piece.triangles[n * step][k] - piece.first]);
                middle = plus(middle, 1.0 / 3, corners[k]);
            }
            area[n] = length(meshing::area_normal(corners[0], corners[1], corners[2]));
            is_bare[n] = !cells.any_within(middle, reach);
        });
        for (std::size_t n = 0; n < area.size(); ++n) {
            all += area[n];
            bare += is_bare[n] * area[n];
        }
    });
    return bare > kCommon.minority * all;
}

}  // namespace

void cloud::settle(FloatGrid& field, const CloudOrientation& cloud, CloudReport& report, const RunContext& run) {
    const Orientation& orientation = cloud.orientation;
    // Noise creates spurious pieces with few points, which are removed. If the points enclose nothing, a separate piece
    // is not a thin part of a solid, so it must have more points to be kept.
    const double fraction = cloud.encloses ? kCloud.few : kCommon.negligible, noises = report.noise / report.spacing;
    const auto minimum = std::size_t(
        std::max({double(kCommon.quadric), fraction * double(cloud.points.size()), 4 * M_PI * noises * noises}));
    report.dropped_pieces = detail::drop_bare_pieces(field, cloud.points, minimum);
    // Pieces that were torn off are joined before the indicator's topology is imposed, because the indicator may lack
    // them, and again afterwards, because imposing it may tear off others.
    const auto join = [&] {
        const std::size_t joined = cloud::join_pieces(field, cloud.points, std::max(report.spacing, report.noise), run);
        report.joined_pieces += joined;
        return joined > 0;
    };
    TopologyOf topology{Complexity(field, run), minimum, cloud.points, run};
    if (topology.own.pieces > 1 && join()) topology.own = Complexity(field, run);
    topology.hold(field, cloud.has_quadrics && orientation.screened ? *orientation.screened : *orientation.indicator,
                  report);
    // If the indicator's cells are as small as the spacing of the points, its surface has small handles around gaps
    // between the points. The topology is then taken from an indicator with larger cells.
    if (topology.own.all > 1 && !orientation.screened && is_open(field, cloud, run))
        topology.hold(field, *cloud::indicator_of(cloud.points, orientation, kCloud.coarse * cloud.scale.spacing, run),
                      report);
    if (topology.own.pieces > 1) join();
}

CloudSurface cloud::settled_field(const Domain& domain, const CloudOrientation& cloud, const RunContext& run) {
    CloudSurface result;
    const cloud::CloudField field(cloud, domain.voxel_size, result.report, run);
    result.u = field.on(domain, run);
    result.creases = field.creases();
    settle(*result.u, cloud, result.report, run);
    return result;
}

CloudSurface surface_from_cloud(const Domain& domain, const CloudOrientation& cloud, const RunContext& run) {
    CloudSurface result;
    with_threads(run, [&] {
        result = cloud::settled_field(domain, cloud, run);
        result.u = start_from_grid(domain, *result.u, run);
    });
    return result;
}

}  // namespace covol
