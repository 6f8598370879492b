// The whole job in one call: from an image and marks to a level set, a mesh and a label image.
//
//     12_whole_job IMAGE POINTS OUT_PREFIX      writes OUT_PREFIX.vdb, OUT_PREFIX.ply and OUT_PREFIX.nrrd
#include <cstdio>
#include <string>

#include "covol/error.h"
#include "covol/mesh_io.h"
#include "covol/pipeline.h"
#include "covol/vdb_io.h"

int main(int argc, char** argv) {
    if (argc != 4) return std::fprintf(stderr, "usage: 12_whole_job IMAGE POINTS OUT_PREFIX\n"), 2;
    try {
        covol::RunContext run;
        run.log = [](covol::LogLevel, const std::string& line) { std::printf("%s\n", line.c_str()); };

        const covol::Image image = covol::read_image(argv[1], {}, run);
        const covol::PointCloud marks = covol::read_points(argv[2]);
        covol::check_inside(marks, image.geometry(), run);  // throws an error that suggests a remedy

        covol::SegmentOptions options;
        options.voxel_size = 3 * image.geometry().spacing[0];  // other options are chosen automatically
        const covol::SegmentResult result =
            covol::segment(image, covol::to_world(marks, image.geometry()), options, run);
        std::printf("volume %g, marks to surface %g on the mean\n", result.report.surface.volume,
                    result.report.fit.mean);

        const std::string prefix = argv[3];
        covol::write_vdb(prefix + ".vdb", {result.surface});
        covol::write_mesh(prefix + ".ply", result.mesh);
        covol::write_image(prefix + ".nrrd", image.geometry(),
                           covol::rasterize(*result.surface, image.geometry()).data());
        return 0;
    } catch (const covol::Error& error) {
        std::fprintf(stderr, "12_whole_job: %s\n", error.what());
        return 1;
    }
}
