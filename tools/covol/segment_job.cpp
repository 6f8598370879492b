#include "segment_job.h"

#include <iomanip>
#include <sstream>

#include "covol/error.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"
#include "report.h"

namespace covol::tool {
namespace {

void check_outputs(const SegmentJob& job, Outputs& outputs) {
    outputs.check("-o", job.output, OutputKind::Vdb);
    outputs.check("--mask", job.mask_path, OutputKind::Image);
    outputs.check("--mesh", job.mesh_path, OutputKind::Mesh);
    outputs.check("--density", job.density_path, OutputKind::Vdb);
    outputs.check("--fields", job.fields_path, OutputKind::Vdb);
    job.mesh.check();
}

SegmentOptions resolve(const SegmentJob& job, double h) {
    SegmentOptions options;
    options.voxel_size = h;
    options.roi = job.domain.roi;
    options.margin = job.domain.margin.resolve(h, 0);
    options.start = job.start;
    options.tag_distance = job.tag.tag_distance.resolve(h, 0);
    if (job.tag.tag_distance.given && !(options.tag_distance > 0))
        throw Error(Errc::InvalidOptions, "--tag-distance: expected > 0, got 0");
    options.exterior_seeds = job.tag.exterior_seeds;
    options.edge = job.edge.resolve(h, -1);
    options.evolve = job.evolve.resolve(h, SegmentOptions::automatic_evolve());
    const double edge = job.min_component.resolve(h, 0);
    options.extract.min_component_volume = edge * edge * edge;
    return options;
}

/// Options that are wrong whatever h is are found before anything is read.
void check_options(const SegmentJob& job) {
    const std::string why = resolve(job, 1.0).why_invalid();
    if (!why.empty()) throw Error(Errc::InvalidOptions, why);
    job.cloud.check();
}

void fill_report(Session& session, const SegmentReport& r) {
    Json& report = session.report();
    report["resolved"] = to_json(r.resolved);
    for (const auto& [what, line] : r.automatic) report["automatic"][what] = line;
    report["grid"] = {{"voxel_size", r.domain.voxel_size},
                      {"active_voxels", r.active_voxels},
                      {"leaf_count", r.leaf_count},
                      {"domain", to_json(r.domain)}};
    if (r.band.tag_distance > 0) report["band"] = to_json(r.band);
    if (r.edge.edge_k > 0) report["edge"] = to_json(r.edge);
    report["solve"] = to_json(r.solve);
    report["surface"] = to_json(r.surface);
    if (r.point_count > 0) report["fit"]["points_to_surface"] = to_json(r.fit);
    session.add_seconds("distance", r.seconds.distance);
    session.add_seconds("tag", r.seconds.tag);
    session.add_seconds("edge", r.seconds.edge);
    session.add_seconds("solve", r.seconds.solve);
    session.add_seconds("surface", r.seconds.surface);
    session.add_seconds("total", r.seconds.total);
}

void summarise(Session& session, const SegmentReport& r) {
    std::ostringstream text;
    text << std::setprecision(4) << r.active_voxels << " active voxels of " << r.domain.voxel_size << ", " << r.solve.steps
         << " steps (" << to_string(r.solve.stop_reason) << "), " << r.seconds.total << " s";
    session.note(text.str());
    session.note("surface: " + one_line(r.surface));
    if (r.point_count == 0) return;
    text.str("");
    text << "points to surface: mean " << r.fit.mean << ", 95 % " << r.fit.p95 << ", max " << r.fit.max;
    session.note(text.str());
}

}  // namespace

void SegmentJob::bind(CLI::App& command, bool with_image) {
    command.add_option("-o,--output", output, "the surface as a level set, .vdb")->required()->type_name("OUT.vdb");
    if (with_image)
        command.add_option("--mask", mask_path, "label image in the image's own geometry")
            ->type_name("OUT.nrrd|.nii.gz|.tif|.mha");
    command.add_option("--mesh", mesh_path, "triangles")->type_name("OUT.ply|.obj|.stl|.off|.glb");
    command.add_option("--density", density_path, "the solid as a fog volume in [0,1]")->type_name("OUT.vdb");
    command.add_option("--fields", fields_path, "u, distance and edge, for a look inside")->type_name("OUT.vdb");
    contours.bind(command);
    cloud.bind(command);
    evolve.bind(command, with_image);
    if (with_image) edge.bind(command);
    tag.bind(command);
    command.add_option_function<std::string>(
               "--init", [this](const std::string& text) { start = parse_start("--init", text); },
               "how the level set starts: tag, sphere:x,y,z,r, box:x0,y0,z0,x1,y1,z1, mesh:F, mask:F or vdb:F")
        ->type_name("START")
        ->default_str("tag");
    domain.bind(command, !with_image);
    add_length(command, "--min-component", min_component, "", "drop pieces of the mesh smaller than a cube of this edge");
    command.add_flag("--half", half, "store values in .vdb files as 16-bit floats");
    mesh.bind(command);
    if (with_image) image.bind(command);
}

void SegmentJob::run(Session& session) {
    check_outputs(*this, session.outputs());
    check_options(*this);

    const Stopwatch reading;
    std::optional<Image> pixels;
    Json& input = session.report()["input"];
    if (!image_path.empty()) {
        const ImageGeometry geometry = read_image_geometry(image_path, image.options);
        session.require_memory(std::uint64_t(geometry.size[0]) * geometry.size[1] * geometry.size[2], "the image");
        pixels = read_image(image_path, image.options, session.run());
        input["image"] = to_json(pixels->geometry());
        input["image"]["path"] = image_path;
    }
    const ImageGeometry* geometry = pixels ? &pixels->geometry() : nullptr;
    WorldPoints marks = read_world_points(points, geometry, session.run());
    const std::vector<PointCloud> drawn = contours.read(points.options, geometry, session.run());
    std::vector<Vec3> given = marks.points;
    for (const PointCloud& cloud : drawn) {
        const std::vector<Vec3> world = to_world(cloud, geometry);
        given.insert(given.end(), world.begin(), world.end());
    }
    input["points"] = {{"count", given.size()}, {"densified", 0}, {"paths", points.paths}, {"rules", marks.rules}};
    session.add_seconds("read", reading.seconds());
    session.add_seconds("total", reading.seconds());

    const Image* pointer = pixels ? &*pixels : nullptr;
    if (pointer == nullptr && given.empty()) throw UsageError("expected an image, points or contours, got none");
    const double h = domain.resolve_voxel_size(pointer, given, session);
    marks.points = cloud.clean(marks.points, h, session, input["points"]);
    SegmentOptions options = resolve(*this, h);
    options.contours = contours.densify(drawn, geometry, h, session);
    // Shared by the writers that run at the end.
    const auto result = std::make_shared<SegmentResult>(segment(pointer, marks.points, options, session.run()));
    input["points"]["densified"] = result->report.densified;
    fill_report(session, result->report);
    summarise(session, result->report);

    const WriteVdbOptions vdb{half, session.metadata()};
    Outputs& outputs = session.outputs();
    outputs.add(output, [=](const std::string& path) { write_vdb(path, {result->surface}, vdb); });
    outputs.add(density_path, [=](const std::string& path) { write_vdb(path, {density(*result->surface)}, vdb); });
    outputs.add(fields_path, [=](const std::string& path) {
        std::vector<FloatGridPtr> grids{result->u};
        for (const FloatGridPtr& field : {result->distance, result->edge})
            if (field) grids.push_back(field);
        write_vdb(path, grids, vdb);
    });
    outputs.add(mesh_path, [=, write = mesh.options(session)](const std::string& path) {
        write_mesh(path, result->mesh, write);
    });
    if (!mask_path.empty())
        outputs.add(mask_path, [=, geometry = pixels->geometry(), &session](const std::string& path) {
            write_image(path, geometry, rasterize(*result->surface, geometry, 1, session.run()).data());
        });
    if (evolve.strict && result->report.solve.stop_reason != StopReason::Steady) session.set_exit_code(kNotSteady);
}

}  // namespace covol::tool
