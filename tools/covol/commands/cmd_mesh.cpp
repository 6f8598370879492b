#include "cli/options/arguments.h"
#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/mesh_cleanup.h"
#include "covol/mesh_relax.h"
#include "covol/mesh_stream.h"
#include "covol/surface.h"
#include "flags/bindings.h"

namespace covol::tool {
namespace {

struct MeshJob {
    std::string input, output;
    Given<ExtractOptions> extract;
    Given<CleanupOptions> cleanup;
    MeshFlags flags;

    void clean(TriangleMesh& mesh, const FloatGrid& level_set, double h, Session& session) const {
        if (cleanup.names.empty()) return;
        const Stopwatch watch;
        const CleanupReport done =
            clean_mesh(mesh, level_set, extract.resolve(h).isovalue, cleanup.resolve(h), session.run());
        session.add_seconds("clean", watch.seconds());
        session.report()["cleanup"] = {{"self_intersections", done.self_intersections},
                                       {"holes_filled", done.holes_filled},
                                       {"intersection_free", done.intersection_free}};
        const auto record = [&](const char* step, const std::optional<CleanupStep>& made) {
            if (!made) return;
            const MeshDeviation change{made->change.max / h, made->change.mean / h};
            session.report()["cleanup"][step] = {{"triangles", made->triangles},
                                                 {"smallest_angle", made->smallest_angle},
                                                 {"change_voxels", to_json(change)},
                                                 {"deviation_voxels", to_json(made->deviation)}};
            session.note(std::string(step) + ": " + mesh_line(made->triangles, made->smallest_angle, made->deviation) +
                         "; off the mesh before: " + one_line(change));
        };
        record("decimation", done.decimation);
        record("smoothing", done.smoothing);
    }

    /// Writes the unmodified mesh of marching cubes while the tree is traversed, without holding the whole mesh.
    void stream(const FloatGridPtr& level_set, double h, Session& session) const {
        session.outputs().add(output, [this, level_set, h, &session](const std::string& path) {
            const StreamedMesh made =
                stream_mesh(path, *level_set, extract.resolve(h).isovalue, flags.write_options(session), session.run());
            session.report()["mesh"] = {{"vertices", made.vertices}, {"triangles", made.triangles}};
            session.report()["surface"] = to_json(made.measures);
            session.note("mesh: " + plain_mesh_line(made.triangles));
            session.note("surface: " + one_line(made.measures));
        });
    }

    void check_plain() const {
        if (!flags.plain) return;
        if (!cleanup.names.empty() || extract.has("min_component"))
            throw UsageError(
                "--plain: excludes --repair, --smooth, --target-edge, --adaptive and --min-component, which need the "
                "whole mesh");
        flags.check_plain(output);
    }

    void run(Session& session) const {
        session.outputs().check("-o", output, OutputKind::Mesh);
        check_plain();
        const FloatGridPtr level_set = read_vdb_level_set(input, session.run());
        session.provenance().set_world(*level_set);
        const double h = domain_of(*level_set).voxel_size;
        if (flags.plain) return stream(level_set, h, session);
        const Stopwatch watch;
        TriangleMesh mesh = extract_mesh(*level_set, extract.resolve(h), session.run());
        session.add_seconds("surface", watch.seconds());
        if (mesh.triangles.empty())
            throw Error(
                Errc::InvalidInput,
                input + ": nothing to mesh: no surface at --isovalue, or all of it smaller than --min-component");
        const Stopwatch relaxing;
        const RelaxReport relaxed = relax_mesh(mesh, *level_set, {extract.resolve(h).isovalue}, session.run());
        session.add_seconds("relax", relaxing.seconds());
        session.report()["mesh"] = to_json(relaxed);
        session.note("mesh: " + mesh_line(relaxed.triangles, relaxed.smallest_angle, relaxed.deviation));
        clean(mesh, *level_set, h, session);
        const MeshMeasures measures = measure(mesh);
        session.report()["surface"] = to_json(measures);
        session.note("surface: " + one_line(measures));
        session.outputs().add(
            output, [mesh = std::make_shared<TriangleMesh>(std::move(mesh)), write = flags.write_options(session)](
                        const std::string& path) { write_mesh(path, *mesh, write); });
    }
};

}  // namespace

void add_mesh(Session& session) {
    const auto [job, command] =
        session.add_job<MeshJob>("mesh", "Make a triangle mesh of a level set, and clean it up");
    in_group(*command, Group::Input);
    command->add_option("level_set", job->input, "a level set; :NAME selects one of several in a file")
        ->required()
        ->type_name("IN.vdb[:NAME]");
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->output, "closed, manifold mesh with outward normals")
        ->required()
        ->type_name("OUT.ply|.obj|.stl|.off|.glb");
    job->cleanup.options.repair = false;
    bind_options(*command, job->extract, Offered::SingleStep);
    bind_options(*command, job->cleanup, Offered::SingleStep);
    job->flags.bind_plain(*command);
    job->flags.bind(*command);
}

}  // namespace covol::tool
