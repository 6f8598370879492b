#include "commands/commands.h"
#include "jobs/segment_job.h"

namespace covol::tool {

void add_reconstruct(Session& session) {
    const auto [job, command] =
        session.add_job<SegmentJob>("reconstruct", "Find the surface behind a point cloud, without an image");
    job->given.options.evolve.rho = 0;
    job->points.bind(*command, "points");
    job->bind(*command, false);
    session.help().show_first(*command, {"points", "--mesh", "--inside", "--remove-outliers", "--most-points",
                                         "--simplify", "--smooth", "--holes", "--voxel-size"});
}

}  // namespace covol::tool
