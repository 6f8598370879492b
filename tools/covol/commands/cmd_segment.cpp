#include "commands/commands.h"
#include "jobs/segment_job.h"

namespace covol::tool {

void add_segment(Session& session) {
    const auto [job, command] =
        session.add_job<SegmentJob>("segment", "Find the surface of a structure in an image, with the help of marks");
    in_group(*command, Group::Input);
    command
        ->add_option("image", job->images,
                     "3D image: TIFF, OME-Zarr, NRRD, NIfTI, MetaImage, DICOM, MRC, ICS, HDF5, NumPy, .vdb; several "
                     "are a time-lapse [the study's]")
        ->type_name("IMAGE...");
    job->points.bind(*command, "--points")
        ->description(
            "marks on the surface: tables, marks of Fiji, napari, 3D Slicer and ITK-SNAP, point clouds; for several "
            "structures with names, ve=FILE exe=FILE")
        ->type_name("[NAME=]FILE...");
    command->add_option("--study", job->study, "folder with the structures and marks of covol mark")
        ->type_name("STUDY");
    job->bind(*command, true);
    session.help().show_first(
        *command, {"--points", "--contours", "--painted", "--inside", "--outside", "--guess", "--mask", "--mesh",
                   "--report", "--suggest", "--frame", "--rho", "--voxel-size"});
}

}  // namespace covol::tool
