#include "commands.h"
#include "segment_job.h"

namespace covol::tool {

void add_segment(Session& session) {
    const auto job = std::make_shared<SegmentJob>();
    CLI::App* command = session.add_command("segment", "Image and points together: the surface of a structure",
                                            [job, &session] { job->run(session); });
    command->add_option("image", job->image_path, "3D image: TIFF, NRRD, NIfTI, MetaImage")->required()->type_name("IMAGE");
    job->points.bind(*command, "--points");
    job->bind(*command, true);
}

}  // namespace covol::tool
