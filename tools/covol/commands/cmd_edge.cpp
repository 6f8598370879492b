#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/edge.h"
#include "covol/vdb_io.h"
#include "flags/bindings.h"
#include "flags/vdb_flags.h"

namespace covol::tool {
namespace {

struct EdgeJob {
    std::string image_path, band_path, output;
    ImageFlags image;
    Given<EdgeOptions> edge;
    VdbFlags vdb;

    void run(Session& session) const {
        session.outputs().check("-o", output, OutputKind::Vdb);
        const FloatGridPtr topology = read_vdb(band_path);
        const Domain domain = domain_of(*topology);
        const double h = domain.voxel_size;
        ReadImageOptions reading = image.options;
        reading.roi = sampled_box(domain.world_box(), h);
        const Image pixels = read_image(image_path, reading, session.run());
        session.provenance().set_world(pixels.geometry());
        const Stopwatch watch;
        const EdgeResult result = detect_edges(pixels, *topology, edge.resolve(h), session.run());
        session.add_seconds("edge", watch.seconds());
        session.report()["input"]["image"] = to_json(pixels.geometry());
        session.report()["edge"] = to_json(result.report);
        session.note("K = " + std::to_string(result.report.edge_k) + ": g = 1/2 at a gradient of " +
                     std::to_string(result.report.edge_contrast));
        session.add_grid(output, result.grid, vdb.options);
    }
};

}  // namespace

void add_edge(Session& session) {
    const auto [job, command] = session.add_job<EdgeJob>("edge", "Step 3: the image's edge detector g on the band");
    in_group(*command, Group::Input);
    command->add_option("image", job->image_path, "3D image")->required()->type_name("IMAGE");
    command->add_option("--band", job->band_path, "grid on whose active voxels g is computed")
        ->required()
        ->type_name("BAND.vdb");
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->output, "the grid 'edge', .vdb")->required()->type_name("OUT.vdb");
    bind_options(*command, job->edge, Offered::SingleStep);
    job->image.bind(*command, {"roi"});
    job->vdb.bind(*command);
}

}  // namespace covol::tool
