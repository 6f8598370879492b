#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"
#include "flags/bindings.h"
#include "flags/vdb_flags.h"

namespace covol::tool {
namespace {

struct SurfaceJob {
    std::string input, output, density_path;
    VdbFlags vdb;

    void run(Session& session) const {
        session.outputs().check("-o", output, OutputKind::Vdb);
        const bool in_one = density_path == output;
        if (!in_one) session.outputs().check("--density", density_path, OutputKind::Vdb);
        const FloatGridPtr u = read_vdb(input);
        session.provenance().set_world(*u);
        const Stopwatch watch;
        const FloatGridPtr level_set = extract_surface(*u, session.run());
        session.add_seconds("surface", watch.seconds());
        session.report()["grid"] = {{"voxel_size", domain_of(*level_set).voxel_size}};
        const WriteVdbOptions write = vdb.with(session.provenance().metadata());
        session.outputs().add(output, [=](const std::string& path) {
            if (in_one) return write_vdb(path, {to_fog_volume(*level_set), level_set}, write);
            write_vdb(path, {level_set}, write);
        });
        if (in_one) return;
        session.outputs().add(density_path,
                              [=](const std::string& path) { write_vdb(path, {to_fog_volume(*level_set)}, write); });
    }
};

}  // namespace

void add_surface(Session& session) {
    const auto [job, command] =
        session.add_job<SurfaceJob>("surface", "Step 5: the zero level set as a true signed distance");
    in_group(*command, Group::Input);
    command->add_option("u", job->input, "output of `covol evolve`")->required()->type_name("U.vdb");
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->output, "the grid 'surface', .vdb")->required()->type_name("OUT.vdb");
    command->add_option("--density", job->density_path, kDensityHelp)->type_name("OUT.vdb");
    job->vdb.bind(*command);
}

}  // namespace covol::tool
