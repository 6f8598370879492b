#include <openvdb/openvdb.h>

#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/error.h"
#include "covol/evolve.h"
#include "covol/vdb_io.h"
#include "flags/bindings.h"
#include "flags/checkpoint_flags.h"
#include "flags/vdb_flags.h"

namespace covol::tool {
namespace {

struct EvolveJob {
    std::string band_path, distance_path, edge_path, output;
    Given<EvolveOptions> given;
    CheckpointFlags checkpoint;
    VdbFlags vdb;

    /// The options for voxels of edge h; the weight of a field whose file is not given is set to 0.
    EvolveOptions resolve(double h, Session& session) const {
        EvolveOptions options = given.resolve(h);
        if (distance_path.empty() && options.theta > 0) {
            options.theta = 0;
            session.note("theta: 0 (there is no --distance)");
        }
        if (edge_path.empty() && options.rho > 0) {
            options.rho = 0;
            session.note("rho: 0 (there is no --edge)");
        }
        return options;
    }

    void run(Session& session) const {
        session.outputs().check("-o", output, OutputKind::Vdb);
        checkpoint.begin(session);
        const FloatGridPtr u = read_vdb(band_path);
        session.provenance().set_world(*u);
        const FloatGridPtr d = distance_path.empty() ? nullptr : read_vdb(distance_path);
        const FloatGridPtr g = edge_path.empty() ? nullptr : read_vdb(edge_path);
        const EvolveOptions options = resolve(domain_of(*u).voxel_size, session);
        EvolveFields fields;
        fields.distance = options.theta > 0 ? d.get() : nullptr;
        fields.edge = options.rho > 0 ? g.get() : nullptr;
        const Stopwatch watch;
        const EvolveReport result = evolve(*u, fields, options, session.run());
        session.run().check();
        u->setName("u");
        session.add_seconds("solve", watch.seconds());
        session.report()["grid"] = {{"voxel_size", domain_of(*u).voxel_size},
                                    {"active_voxels", result.active_voxels},
                                    {"leaf_count", result.leaf_count}};
        session.report()["solve"] = to_json(result);
        session.note(std::to_string(result.steps) + " steps, " + to_string(result.stop_reason));
        if (result.stop_reason == StopReason::Vanished)
            session.warn("the surface vanished after " + std::to_string(result.steps) +
                         " steps; lower --delta, or start closer to the points or edges");
        else if (result.stop_reason != StopReason::Steady)
            session.warn("not steady after " + std::to_string(result.steps) +
                         " steps; increase --max-steps to continue until the surface is steady");
        session.add_grid(output, u, vdb.options);
    }
};

}  // namespace

void add_evolve(Session& session) {
    const auto [job, command] =
        session.add_job<EvolveJob>("evolve", "Step 4: move the level set to the structure's boundary");
    in_group(*command, Group::Input);
    command->add_option("band", job->band_path, "output of `covol band`, or the grid u of an earlier run")
        ->required()
        ->type_name("BAND.vdb");
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->output, "the grid u, .vdb")->required()->type_name("OUT.vdb");
    in_group(*command, Group::Input);
    command->add_option("--distance", job->distance_path, "output of `covol distance`")->type_name("DISTANCE.vdb");
    command->add_option("--edge", job->edge_path, "output of `covol edge`")->type_name("EDGE.vdb");
    bind_options(*command, job->given, Offered::SingleStep);
    job->checkpoint.bind(*command);
    job->vdb.bind(*command);
    session.help().show_first(*command, {"--distance", "--edge", "--theta", "--rho", "--delta", "--tau",
                                         "--attraction-range", "--max-steps", "--tolerance", "--follow"});
}

}  // namespace covol::tool
