#include "covol/segment_structures.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Morphology.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "covol/error.h"
#include "covol/mesh_relax.h"
#include "covol/mesh_stream.h"
#include "covol/seeds.h"
#include "covol/surface.h"
#include "guidance/heuristics.h"
#include "marks/with_name.h"
#include "meshing/level_set_distance.h"
#include "meshing/mesh_distance.h"
#include "segment/result/mark_fit.h"
#include "segment/step.h"

namespace covol {
namespace {

constexpr double kAccuracyVoxels = 0.25;  // [voxels of the image] accuracy within reach_of_marks()
constexpr double kWeakLine = 0.93;        // weak_edge for lines: 1 - g at 1.2 times the brightness of the band's median
constexpr double kLargeOverlap = 0.02;    // overlaps above this fraction of the smaller structure's volume are reported
constexpr double kMinCorrelation = 0.5;   // minimum correlation of the intensities along a surface from frame to frame
// [voxels] Width by which the surface's band is dilated, so that the slopes of the image beside the edges also
// contribute to the contrast of g.
constexpr int kBesideBand = 5;

/// The region in which edges are computed for a surface that was found without them.
FloatGridPtr around(const FloatGrid& surface) {
    FloatGridPtr topology = surface.deepCopy();
    openvdb::tools::dilateActiveValues(topology->tree(), kBesideBand, openvdb::tools::NN_FACE,
                                       openvdb::tools::EXPAND_TILES);
    const Domain domain = domain_of(surface);
    topology->clip({openvdb::Coord(domain.min.data()), openvdb::Coord(domain.max.data())});
    return topology;
}

/// The distance from a mark up to which the surface of minimum bending energy is accurate to a quarter of a voxel of
/// the image: at a distance d its error is kGuide.fraction_of_sagitta d^2 / (2 R), where R is the radius of a ball with
/// the body's ratio of volume to area. It is at least one voxel of the image.
double reach_of_marks(const SegmentResult& result, const Image& image) {
    const MeshMeasures& body = result.report.surface;
    const double radius = body.area > 0 ? 3 * std::abs(body.volume) / body.area : 0;
    const double voxel = image.geometry().smallest_spacing();
    return std::max(std::sqrt(2 * radius * kAccuracyVoxels * voxel / kGuide.fraction_of_sagitta), voxel);
}

/// Updates all measurements of the surface, as in segment().
void measure_again(StructureResult& structure, const std::optional<Image>& image, const RunContext& run) {
    SegmentReport& report = structure.result.report;
    const SegmentOptions& options = report.resolved;
    const FloatGrid& surface = *structure.result.surface;
    TriangleMesh& mesh = structure.result.mesh;
    if (options.without_mesh) {
        const StreamedMesh made = measure_surface(surface, 0, run);
        report.mesh.triangles = std::int64_t(made.triangles);
        report.surface = made.measures;
    } else {
        mesh = extract_mesh(surface, options.extract, run);
        report.mesh = relax_mesh(mesh, surface, {options.extract.isovalue}, run);
        report.surface = measure(mesh);
    }
    report.seeds = check_seeds(surface, options.inside, options.outside);
    report.seeds.painted = options.painted_seeds;
    if (structure.marks.empty()) return;
    std::vector<double> distances;
    with_threads(run, [&] {
        distances = options.without_mesh ? detail::distances_to(surface, structure.marks)
                                         : detail::distances_to(mesh, structure.marks);
    });
    report.fit = detail::statistics_of(distances);
    // After the separation, a mark of two structures lies off the surface of at least one of them. This is reported
    // as information, not as a warning.
    for (const std::string& line :
         pipeline::compare_with_marks(report, surface, image ? &*image : nullptr, structure.marks, distances))
        run.info("after separation from the other structures, " + line);
}

/// Makes the surfaces disjoint, measures those that changed again, and reports large overlaps.
void separate_all(StructuresResult& all, const std::optional<Image>& image, const RunContext& run) {
    const auto begin = std::chrono::steady_clock::now();
    std::vector<Structure> solids;
    for (const StructureResult& structure : all.structures)
        solids.push_back({structure.name, structure.result.surface});
    SeparateResult separated = separate(solids, {}, run);
    for (std::size_t n = 0; n < all.structures.size(); ++n) {
        if (!separated.report.changed[n]) continue;
        StructureResult& structure = all.structures[n];
        structure.result.surface = separated.surfaces[n];
        measure_again(structure, image, speaking_for(structure.name, all.structures.size(), run));
    }
    all.overlaps = std::move(separated.report.overlaps);
    for (const StructureOverlap& overlap : all.overlaps) {
        if (overlap.inner) continue;  // one structure inside the other, which is intended
        const StructureResult &a = all.structures[overlap.a], &b = all.structures[overlap.b];
        const double smaller = std::min(a.result.report.surface.volume, b.result.report.surface.volume);
        if (overlap.volume < kLargeOverlap * smaller) continue;
        run.info("'" + a.name + "' and '" + b.name + "' overlapped by " + pipeline::number(overlap.volume) + " (" +
                 pipeline::number(std::round(100 * overlap.volume / smaller)) +
                 " % of the smaller one); their border was placed halfway: add marks where they touch");
    }
    all.separate_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

VoxelSizeChoice choose_voxel_size(const std::optional<Image>& image, const Marks& marks,
                                  const SegmentOptions& options) {
    if (image) return choose_voxel_size(*image);
    return choose_voxel_size(positions_of(marks, {}), !marks.contours.empty() || options.tags_points());
}

SegmentResult solve_structure(const std::optional<Image>& image, const StructureInput& structure,
                              const RunContext& run) {
    return image ? segment(*image, structure.points, structure.options, run)
                 : reconstruct(structure.points, structure.options, run);
}

StructuresResult segment_structures(const std::optional<Image>& image, std::vector<Marks> marks,
                                    const StructuresOptions& options, const RunContext& run,
                                    const StructureSolver& solve) {
    if (!image && marks.size() > 1) throw Error(Errc::InvalidInput, "several structures need an image");
    SegmentOptions common = options.segment;
    if (!common.voxel_size && !marks.empty()) {
        const VoxelSizeChoice choice = choose_voxel_size(image, marks.front(), common);
        common.voxel_size = choice.voxel_size;
        common.voxel_size_may_grow = true;
        run.info("voxel_size: " + choice.reason);
    }
    std::optional<ImageGeometry> geometry;
    if (image) geometry = image->geometry();
    std::vector<StructureInput> inputs = prepare_marks(std::move(marks), geometry, common, options.marks, run);
    StructuresResult all;
    for (StructureInput& input : inputs) {
        const RunContext own = speaking_for(input.name, inputs.size(), run);
        StructureResult made{std::move(static_cast<StructureFacts&>(input)), {}, {}, {}};
        made.result = detail::with_name(made.name, [&] {
            if (input.guess) {
                made.guess = input.guess(own);
                input.options.guess = made.guess->start;
            }
            return solve(image, input, own);
        });
        if (inputs.size() > 1 && made.guess) made.guess->mask.reset();
        input = {};
        all.structures.push_back(std::move(made));
    }
    if (inputs.size() > 1) separate_all(all, image, run);
    for (StructureResult& structure : all.structures) structure.result.surface->setName(structure.grid);
    return all;
}

StructuresResult TimeLapse::segment(const Image& frame, std::vector<Marks> marks, const StructuresOptions& options,
                                    const RunContext& run) {
    std::vector<std::optional<MotionReport>> motions(marks.size());
    for (std::size_t n = 0; n < last_.size(); ++n) {
        Last& last = last_[n];
        if (n >= marks.size() || marks.size() != last_.size() || marks[n].name != last.name)
            throw Error(Errc::InvalidInput,
                        "TimeLapse: expected the structures of the previous frame, in the same order");
        if (last.look) {
            const RunContext own = speaking_for(last.name, last_.size(), run);
            Followed followed = last.look->follow(frame, own);
            marks[n].start = LevelSetStart{std::move(followed.u), true};
            motions[n] = followed.report;
            if (followed.report.correlation < kMinCorrelation)
                own.warn("the image around the surface differs from that in the previous frame (correlation " +
                         pipeline::number(std::round(100 * followed.report.correlation) / 100) +
                         "): the surface may have lost the structure; mark this frame");
        } else {
            marks[n].start = LevelSetStart{last.surface};
        }
        marks[n].delta = last.delta;
    }
    StructuresOptions with_u = options;
    with_u.segment.without_fields = false;
    const bool without_fields = options.segment.without_fields;
    StructuresResult all =
        segment_structures(frame, std::move(marks), with_u, run,
                           [&](const std::optional<Image>& image, const StructureInput& input, const RunContext& own) {
                               SegmentResult result = solve_structure(image, input, own);
                               if (without_fields) result.distance = result.edge = nullptr;
                               return result;
                           });
    last_.clear();
    for (std::size_t n = 0; n < all.structures.size(); ++n) {
        StructureResult& structure = all.structures[n];
        SegmentResult& result = structure.result;
        structure.motion = motions[n];
        Last last{structure.name, result.surface, result.report.resolved.evolve.delta, {}};
        if (result.report.solve.steps == 0 && result.report.resolved.model == Model::Guided) {
            last.surface = result.u;
            last.look.emplace(last.surface, frame, run);
        }
        if (without_fields) result.u = nullptr;
        last_.push_back(std::move(last));
    }
    return all;
}

Evidence assess_evidence(const SegmentResult& result, const std::vector<Vec3>& marks, const Image& image,
                         int suggestions, const RunContext& run) {
    const SegmentOptions& used = result.report.resolved;
    EvidenceOptions options;
    const double range = used.evolve.attraction_range.value_or(0);
    options.reach = range > 0 ? range : reach_of_marks(result, image);
    options.suggestions = suggestions;
    // For lines as edges, g depends on the intensity. This is rarely 0, unlike slopes, so that g falls below 1/2 even
    // without a line: with the usual weak_edge, every position would count as supported by the image.
    if (is_line(used.edge.feature)) options.weak_edge = kWeakLine;
    FloatGridPtr g = result.edge;
    if (!g) {  // g was not computed, because the flow did not use the edges
        EdgeOptions edge = used.edge;
        if (!edge.sigma) edge.sigma = image.geometry().smallest_spacing();
        g = detect_edges(image, *around(*result.surface), edge, run).grid;
    }
    return assess_evidence(result.mesh, marks, *g, image.geometry(), options, run);
}

}  // namespace covol
