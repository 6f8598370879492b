#include "segment/result/final_surface.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "base/heuristics.h"
#include "cloud/surface/hold_topology.h"
#include "cloud/surface/sharp_mesh.h"
#include "covol/clip.h"
#include "covol/compare.h"
#include "covol/error.h"
#include "covol/mesh_stream.h"
#include "covol/start.h"
#include "holes/heuristics.h"
#include "holes/share_beyond.h"
#include "meshing/level_set_distance.h"
#include "meshing/mesh_distance.h"

namespace covol::pipeline {
namespace {

constexpr std::size_t kMaxReportedLoops = 8;

int complexity(const MeshMeasures& m) { return m.components + std::max(0, m.genus); }

/// The inputs of a surface, and the surface as far as it is complete.
struct Maker {
    const Problem& problem;
    const Choices& choices;
    const Domain& domain;
    const std::vector<Vec3>& points;  ///< those that attract, without stray points
    const Creases* creases;           ///< of the field from which the surface is made, or null
    Surface made;

    [[nodiscard]] const SegmentOptions& options() const { return problem.options; }
    [[nodiscard]] const RunContext& run() const { return problem.run; }

    /// @param is_field  whether u is the field of a cloud, which is not a distance
    void take_level_set(FloatGridPtr u, const FloatGridPtr& known, bool is_field) {
        if (known) {
            made.level_set = known;
            made.u = std::move(u);
            return;
        }
        set_clip(*u, problem.clip());
        made.level_set = extract_surface(*u, run());
        const FloatGrid& band = is_field ? *made.level_set : *u;
        made.active_voxels = std::int64_t(band.activeVoxelCount());
        made.leaf_count = std::int64_t(band.tree().leafCount());
        if (options().without_fields) return;
        made.u = std::move(u);
        if (!is_field) return;
        made.u = start_from_grid(domain, *made.u, run());
        set_clip(*made.u, problem.clip());
    }

    void relax() {
        made.mesh_report = relax_mesh(made.mesh, *made.level_set, {options().extract.isovalue}, run());
        if (creases == nullptr || options().extract.isovalue != 0) return;
        if (const std::size_t divided = cloud::sharpen(made.mesh, *creases, domain.voxel_size); divided > 0)
            run().info("mesh: " + std::to_string(divided) + " edges split along creases");
    }

    void take_mesh() {
        made.mesh = extract_mesh(*made.level_set, options().extract, run());
        relax();
    }

    void take_surface_of(const FloatGrid& level_set) {
        made.level_set = extract_surface(level_set, run());
        take_mesh();
    }

    /// Replaces level set and mesh by those of another closed mesh. If these have more pieces and handles, their
    /// topology is constrained to that of the previous surface.
    void replace_by(const TriangleMesh& mesh) {
        const int before = complexity(measure(made.mesh));
        const FloatGridPtr rough = made.level_set;
        const FloatGridPtr level_set = start_from_mesh(domain, mesh, run());
        take_surface_of(*level_set);
        if (complexity(measure(made.mesh)) <= before) return;
        cloud::hold_topology(*rough, *level_set, run());
        take_surface_of(*start_from_grid(domain, *level_set, run()));
    }

    /// A surface that is defined by points alone may have holes between them.
    [[nodiscard]] bool may_have_holes() const { return !points.empty() && problem.image == nullptr; }

    /// The mesh with the parts that are farther than `distance` from all points removed, or replaced by flat ones; none
    /// if the mesh is kept unchanged.
    std::optional<TreatedHoles> treated_holes(double distance, double slack) const {
        const auto trimmed = [&] { return trim_holes(made.mesh, made.distance_to_points, distance, slack, run()); };
        switch (options().holes.policy) {
            case Holes::Close: return {};
            case Holes::Open: return trimmed();
            case Holes::Flat: return flatten_holes(made.mesh, made.distance_to_points, distance, slack, run());
            case Holes::Auto: break;
        }
        if (made.fraction_without_points <= kCommon.negligible || options().contours) return {};
        try {
            TreatedHoles open = trimmed();
            double rims = 0;
            for (const BoundaryLoop& loop : open.report.loops) rims += loop.length;
            // If the points lie on an open sheet, the part that closes it, which is without points, is at least as
            // large as the sheet. Points along curves leave as much surface without points, but the parts near them are
            // narrow strips, whose area is small relative to the length of their rims.
            const bool is_sheet = measure(open.mesh).area > 2 * distance * rims;
            if (is_sheet && open.report.fraction > 0.5) return open;
        } catch (const Error& error) {
            // Everything was trimmed, for example because the points lie along curves: the closed surface is kept.
            if (error.code() != Errc::InvalidInput) throw;
        }
        return {};
    }

    /// Measures which part of the surface is without points, and treats it according to the options.
    void treat_holes() {
        const HolesOptions& requested = options().holes;
        HolesReport& holes = made.holes;
        const double automatic = choose_hole_distance(points, choices.h),
                     distance = requested.distance.value_or(automatic);
        // Width kept beyond the last points: at most half of the points' spacing, or half a voxel if that is more.
        const double slack = 0.5 / kHoles.far * std::min(automatic, distance);
        made.distance_to_points = measure_distances(made.mesh, points, run());
        made.fraction_without_points = measure_fraction_beyond(made.mesh, made.distance_to_points, distance);
        holes.distance = distance;
        std::optional<TreatedHoles> treated = treated_holes(distance, slack);
        if (!treated) return;
        holes = std::move(treated->report);
        if (holes.policy == Holes::Open) {
            const double volume = measure(made.mesh).volume;
            made.mesh = std::move(treated->mesh);
            if (holes.fraction > 0) {
                holes.closed_volume = volume;
                relax();
            }
        } else if (holes.fraction > 0) {
            replace_by(treated->mesh);
        }
        if (holes.fraction > 0) made.distance_to_points = measure_distances(made.mesh, points, run());
        report_holes();
    }

    void report_holes() {
        const HolesReport& holes = made.holes;
        std::string lengths;
        for (std::size_t n = 0; n < holes.loops.size() && n < kMaxReportedLoops; ++n)
            lengths += (n > 0 ? ", " : "") + number(holes.loops[n].length);
        made.report.remarks.choose(
            "holes", to_string(holes.policy),
            (options().holes.policy == Holes::Auto ? "the points cover only one side of an object; " : std::string()) +
                (holes.loops.empty() ? "none: the whole surface is within " + number(holes.distance) + " of points"
                                     : std::to_string(holes.loops.size()) +
                                           (holes.loops.size() > 1 ? " rims, of lengths " : " rim, of length ") +
                                           lengths + (holes.loops.size() > kMaxReportedLoops ? ", ..." : "") +
                                           (holes.policy == Holes::Open ? "; the level set stays closed" : "")),
            run());
    }

    void measure_without_mesh() {
        StreamedMesh mesh;
        if (may_have_holes()) {
            made.holes.distance =
                options().holes.distance ? *options().holes.distance : choose_hole_distance(points, choices.h);
            const detail::BeyondPoints measured =
                detail::measure_beyond(*made.level_set, points, made.holes.distance, run());
            made.fraction_without_points = measured.fraction;
            mesh = measured.mesh;
        } else {
            mesh = measure_surface(*made.level_set, 0, run());
        }
        made.measures = mesh.measures;
        made.mesh_report.triangles = std::int64_t(mesh.triangles);
        if (!points.empty()) made.mark_distances = detail::distances_to(*made.level_set, made.marks);
    }

    void make_and_measure_mesh() {
        take_mesh();
        if (may_have_holes()) treat_holes();
        // The two measurements run at the same time, because parts of each use a single thread.
        tbb::parallel_invoke([&] { made.measures = measure(made.mesh); },
                             [&] {
                                 if (!points.empty()) made.mark_distances = detail::distances_to(made.mesh, made.marks);
                             });
        if (made.holes.closed_volume > 0) made.measures.volume = made.holes.closed_volume;
    }
};

}  // namespace

Surface make_surface(const Problem& problem, const Choices& choices, Solution& solution, const FloatGridPtr& known) {
    const bool is_field = solution.start.origin == StartOrigin::Cloud &&
                          is_final_start(problem, solution.start, solution.edges.options.feature);
    const std::vector<Vec3>& points = choices.cloud ? choices.cloud->points : solution.start.marks.attracting;
    Maker maker{problem, choices, solution.start.domain, points, is_field ? solution.start.creases.get() : nullptr, {}};
    maker.made.active_voxels = solution.solve.active_voxels;
    maker.made.leaf_count = solution.solve.leaf_count;
    maker.made.marks = choices.measured_marks;
    const std::vector<Vec3>& wrong = solution.start.inference.wrong_marks;
    std::erase_if(maker.made.marks,
                  [&](const Vec3& mark) { return std::find(wrong.begin(), wrong.end(), mark) != wrong.end(); });
    double seconds = 0;
    {
        const Timed timed(seconds);
        if (problem.options.without_fields) solution.distance = solution.edges.grid = nullptr;
        maker.take_level_set(std::move(solution.u), known, is_field);
        problem.options.without_mesh ? maker.measure_without_mesh() : maker.make_and_measure_mesh();
    }
    maker.made.report.seconds.surface = seconds;
    return std::move(maker.made);
}

}  // namespace covol::pipeline
