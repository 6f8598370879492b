#include "commands/commands.h"
#include "jobs/segment_job.h"

namespace covol::tool {

void add_segment(Session& session) {
    const auto [job, command] =
        session.add_job<SegmentJob>("segment", "Image and points together: the surface of a structure");
    command->add_option("image", job->images, "3D image: TIFF, NRRD, NIfTI, MetaImage; several are the frames of a time-lapse")
        ->required()
        ->type_name("IMAGE...");
    job->points.bind(*command, "--points")
        ->description("point clouds: XYZ, CSV, PLY, OBJ, OFF; with names, ve=FILE exe=FILE, several structures")
        ->type_name("[NAME=]FILE...");
    job->bind(*command, true);
}

}  // namespace covol::tool
