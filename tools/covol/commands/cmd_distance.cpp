#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/distance.h"
#include "covol/error.h"
#include "flags/bindings.h"
#include "flags/vdb_flags.h"

namespace covol::tool {
namespace {

constexpr int kTubeVoxels = 10;  // voxels; default radius of the tube around the points

struct DistanceJob {
    PointFlags points;
    Given<SegmentOptions> domain;
    Given<DistanceOptions> tube;
    ImageFlags image;
    std::string like, output;
    VdbFlags vdb;

    Domain choose_domain(const ImageGeometry* geometry, const std::vector<Vec3>& cloud, double h, double radius) const {
        std::optional<WorldBox> whole;
        if (geometry != nullptr) whole = geometry->world_box();
        const WorldBox box = domain.options.roi ? *domain.options.roi
                             : whole            ? *whole
                                                : bounding_box(cloud, domain.length("margin").resolve(h, radius + h));
        return covol::choose_domain(box, h, whole, domain.options.lattice_origin);
    }

    double voxel_size(const ImageGeometry* geometry, const std::vector<Vec3>& cloud, Session& session) const {
        const Length requested = domain.length("voxel_size");
        if (geometry == nullptr || (requested.given && !requested.in_voxels))
            return resolve_voxel_size(requested, nullptr, cloud, true, session);
        const double finest = geometry->smallest_spacing();
        return requested.resolve(finest, finest);
    }

    void run(Session& session) const {
        session.outputs().check("-o", output, OutputKind::Vdb);
        std::optional<ImageGeometry> geometry;
        if (!like.empty()) geometry = read_image_geometry(like, image.options, session.run());
        const ImageGeometry* pointer = geometry ? &*geometry : nullptr;
        geometry ? session.provenance().set_world(*geometry) : session.provenance().set_world_of_points();
        const std::vector<Vec3> cloud = read_world_points(points, geometry, session.run());
        const double h = voxel_size(pointer, cloud, session);
        const double radius = tube.length("max_distance").resolve(h, kTubeVoxels * h);
        const Domain box = choose_domain(pointer, cloud, h, radius);
        const Stopwatch watch;
        const DistanceResult result = compute_distance(cloud, box, {radius}, session.run());
        session.add_seconds("distance", watch.seconds());
        session.report()["input"]["points"]["count"] = cloud.size();
        session.report()["grid"] = {
            {"voxel_size", h}, {"active_voxels", result.report.active_voxels}, {"domain", to_json(box)}};
        session.report()["distance"] = {{"max_distance", radius}, {"rounds", result.report.rounds}};
        session.note(std::to_string(result.report.active_voxels) + " active voxels");
        session.add_grid(output, result.grid, vdb.options);
    }
};

}  // namespace

void add_distance(Session& session) {
    const auto [job, command] =
        session.add_job<DistanceJob>("distance", "Step 1: distance to the points, in a tube around them");
    job->points.bind(*command, "points")->required();
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->output, "the grid 'distance', .vdb")->required()->type_name("OUT.vdb");
    bind_options(*command, job->tube, Offered::SingleStep);
    command->add_option("--like", job->like, "image whose box is the domain [the bounding box of the points]")
        ->type_name("IMAGE");
    bind_options(*command, job->domain, Offered::SingleStep, {}, Group::Domain);
    job->image.bind(*command, {"roi"});
    job->vdb.bind(*command);
    session.help().show_first(*command, {"--max-distance", "--like", "--voxel-size", "--roi"});
}

}  // namespace covol::tool
