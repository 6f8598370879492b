#include "commands.h"
#include "segment_job.h"

namespace covol::tool {

void add_reconstruct(Session& session) {
    const auto job = std::make_shared<SegmentJob>();
    job->evolve.options.rho = 0;
    CLI::App* command = session.add_command("reconstruct", "Points alone: the surface behind a point cloud",
                                            [job, &session] { job->run(session); });
    job->points.bind(*command, "points");
    job->bind(*command, false);
}

}  // namespace covol::tool
