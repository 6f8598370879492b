#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/band.h"
#include "covol/error.h"
#include "covol/vdb_io.h"
#include "flags/bindings.h"
#include "flags/vdb_flags.h"

namespace covol::tool {
namespace {

struct BandJob {
    std::string distance_path, output;
    PointFlags points;
    Given<BandOptions> tag;
    VdbFlags vdb;

    double choose_distance(const Domain& domain, Session& session) const {
        if (tag.has("tag_distance")) return tag.resolve(domain.voxel_size).tag_distance;
        if (points.paths.empty()) throw UsageError("expected --tag-distance, or --points to choose it from");
        const std::vector<Vec3> cloud = read_world_points(points, {}, session.run());
        const TagDistanceChoice choice =
            choose_tag_distance(merge_close_points(cloud, 0), domain, tag.options.exterior_seeds, session.run());
        const std::string line = std::to_string(choice.tag_distance) + " (" + choice.reason + ")";
        session.note("tag_distance: " + line);
        session.report()["automatic"]["tag_distance"] = line;
        return choice.tag_distance;
    }

    void run(Session& session) const {
        session.outputs().check("-o", output, OutputKind::Vdb);
        const FloatGridPtr d = read_vdb(distance_path);
        session.provenance().set_world(*d);
        const double D = choose_distance(domain_of(*d), session);
        const Stopwatch watch;
        const BandResult result = tag_interior(*d, {D, tag.options.exterior_seeds}, session.run());
        session.add_seconds("tag", watch.seconds());
        session.report()["band"] = to_json(result.report);
        session.note(std::to_string(result.report.active_voxels) + " active voxels, encloses " +
                     std::to_string(result.report.enclosed_volume));
        if (result.report.leaks) session.warn(result.report.leak());
        session.add_grid(output, result.grid, vdb.options);
    }
};

}  // namespace

void add_band(Session& session) {
    const auto [job, command] =
        session.add_job<BandJob>("band", "Step 2: tag the inside, and make the narrow band with its initial values");
    in_group(*command, Group::Input);
    command->add_option("distance", job->distance_path, "output of `covol distance`")
        ->required()
        ->type_name("DISTANCE.vdb");
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->output, "the grid 'band', .vdb")->required()->type_name("OUT.vdb");
    bind_options(*command, job->tag, Offered::SingleStep);
    job->points.bind(*command, "--points");
    job->vdb.bind(*command);
    session.help().show_first(*command, {"--points", "--tag-distance", "--exterior-seed"});
}

}  // namespace covol::tool
