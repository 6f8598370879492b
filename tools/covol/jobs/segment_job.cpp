#include "jobs/segment_job.h"

#include <algorithm>
#include <utility>

#include "cli/file_kind.h"
#include "cli/report.h"
#include "covol/error.h"
#include "jobs/brick_job.h"
#include "jobs/marks.h"
#include "jobs/plan_job.h"
#include "jobs/structures_job.h"
#include "jobs/timelapse_job.h"

namespace covol::tool {

double SegmentJob::resolve_voxel_size(const Image* input_image, const Marks& marks, Session& session) const {
    const bool tagged = !marks.drawn.empty() || resolve(1).tags_points();
    return domain.resolve_voxel_size(input_image, marks.given, tagged, session);
}

SegmentOptions SegmentJob::resolve(double h) const {
    SegmentOptions options;
    options.voxel_size = h;
    options.voxel_size_may_grow = !domain.voxel_size.given;
    options.roi = domain.roi;
    options.lattice_origin = domain.lattice_origin;
    options.margin = domain.margin.resolve_above_0(h);
    options.keep_failed = !failed_path.empty();
    options.start = start;
    options.model = model;
    options.mark_precision = mark_precision.resolve(h);
    options.tag_distance = tag.tag_distance.resolve_above_0(h);
    if (tag.tag_distance.given && !options.tag_distance)
        throw Error(Errc::InvalidOptions, "--tag-distance: expected > 0, got 0");
    options.exterior_seeds = tag.exterior_seeds;
    options.edge = edge.resolve(h);
    options.evolve = evolve.resolve(h);
    if (coarse_levels >= 0) options.coarse_levels = coarse_levels;
    options.holes.policy = holes.policy;
    options.holes.distance = hole_distance.resolve_above_0(h);
    if (hole_distance.given && !options.holes.distance)
        throw Error(Errc::InvalidOptions, "--hole-distance: expected > 0, got 0");
    options.correction.least_radius = guess.radius.resolve_above_0(h);
    const double side = min_component.resolve(h, 0);
    options.extract.min_component_volume = side * side * side;
    options.without_mesh = mesh.plain || !needs_mesh();
    options.without_fields = fields_path.empty() && !evidence.wanted();
    return options;
}

bool SegmentJob::needs_mesh() const {
    return !mesh_path.empty() || !page_path.empty() || !scene_path.empty() || evidence.wanted() ||
           holes.policy != Holes::Close || min_component.given;
}

void SegmentJob::check_options() const {
    const std::string why = resolve(1.0).why_invalid();
    if (!why.empty()) throw Error(Errc::InvalidOptions, why);
    cloud.check();
    mesh.check_plain(mesh_path);
    if (mesh.plain && evidence.wanted())
        throw UsageError("--plain: excludes --evidence, --suggest and --report, which need the whole mesh");
}

std::string SegmentJob::unused(const SegmentReport& report) const {
    if (report.solve.steps > 0 || report.solve.stop_reason != StopReason::Steady) return {};
    std::string flags;
    const auto name = [&](bool given, const char* flag) {
        if (given) flags += (flags.empty() ? "" : ", ") + std::string(flag);
    };
    name(evolve.delta.given, "--delta");
    name(evolve.tau.given, "--tau");
    name(evolve.attraction_range.given, "--attraction-range");
    name(evolve.options.image_yields.has_value(), "--image-yields");
    if (flags.empty()) return {};
    return flags +
           " did nothing: the surface is a guess that marks and image hold, and nothing flowed; --model paper flows";
}

void SegmentJob::sort_output(bool with_image) {
    const FileKind kind = output.empty() ? FileKind::Vdb : kind_of_output(output, FileKind::Mesh);
    const bool is_mask = kind == FileKind::Image && with_image && is_image_name(output);
    if (kind != FileKind::Mesh && !is_mask) return;  // what is none of these is not written as .vdb, either
    std::string& alone = is_mask ? mask_path : mesh_path;
    if (!alone.empty())
        throw UsageError("-o " + output + " and " + (is_mask ? "--mask " : "--mesh ") + alone +
                         ": expected one of them; -o OUT.vdb goes with the others");
    alone = std::exchange(output, "");
}

std::string SegmentJob::any_output() const {
    for (const std::string* path : {&output, &mesh_path, &mask_path})
        if (!path->empty()) return *path;
    return {};
}

void SegmentJob::bind(CLI::App& command, bool with_image) {
    in_group(command, Group::Output);
    command
        .add_option("-o,--output", output,
                    std::string("the surface as a level set, .vdb; or ") +
                        (with_image ? "a mesh or a label image" : "a mesh") + " alone, by the name's end")
        ->required()
        ->type_name("OUT.vdb|...");
    command.final_callback([this, with_image] { sort_output(with_image); });
    if (with_image) {
        command.add_option("--mask", mask_path, "label image in the image's own geometry; .seg.nrrd for 3D Slicer")
            ->type_name("OUT.nrrd|.nii.gz|.tif|.mha|.zarr");
        command.add_option("--table", table_path, "volume, area and fit of each structure and frame, as a table")
            ->type_name("OUT.csv");
        evidence.bind(command);
        in_group(command, Group::Input);
        command
            .add_option_function<std::string>(
                "--frame", [this](const std::string& text) { frames = parse_frames("--frame", text); },
                "time points of the image, from 0; of several, each starts from the one before")
            ->type_name("all|N|A-B");
        in_group(command, Group::Output);
    }
    command.add_option("--mesh", mesh_path, "the surface as closed, manifold, outward triangles")
        ->type_name("OUT.ply|.obj|.stl|.off|.glb");
    command.add_option("--density", density_path, kDensityHelp)->type_name("OUT.vdb");
    command
        .add_option("--usda", scene_path,
                    "a scene in USD's text form that refers to the .vdb files, of a time-lapse frame by frame")
        ->type_name("OUT.usda");
    command.add_option("--fields", fields_path, "u, and distance and edge where the flow had them")
        ->type_name("OUT.vdb");
    command
        .add_option("--report", page_path,
                    "one page for the browser: the surface in 3D, slices, figures, options, where new marks would help")
        ->type_name("OUT.html")
        ->each([this](const std::string&) { evidence.for_page = true; });
    command
        .add_option("--keep-failed", failed_path,
                    "where a run fails after its start was made: that start, u, distance and edge as far as they came")
        ->type_name("OUT.vdb");
    contours.bind(command, with_image);
    if (with_image) painted.bind(command);
    seeds.bind(command, with_image);
    if (with_image) guess.bind(command);
    cloud.bind(command, !with_image);
    evolve.bind(command, with_image);
    if (with_image) edge.bind(command);
    tag.bind(command, with_image);
    command
        .add_option_function<std::string>(
            "--init", [this](const std::string& text) { start = parse_start("--init", text); },
            "how the level set starts: auto, guess (through the marks with the least bending), cloud (many points "
            "without an image: their own surface), tag, sphere:x,y,z,r, box:x0,y0,z0,x1,y1,z1 (inside an object and "
            "without marks these grow to its edges), mesh:F, mask:F or vdb:F (near its marks such a start is a guess "
            "that they correct)")
        ->type_name("START")
        ->default_str("auto");
    in_group(command, Group::Start);
    add_choice(
        command, "--model", model, {{"guided", Model::Guided}, {"paper", Model::Paper}},
        "what holds the surface where neither marks nor edges speak: a guess made from the marks, or curvature alone");
    in_group(command, Group::ReadingMarks);
    add_length(command, "--mark-precision", mark_precision, "",
               "standard deviation of a mark's place [0.3 of the image's spacing along each axis]");
    domain.bind(command, !with_image);
    in_group(command, Group::Numerics);
    command
        .add_option("--coarse-levels", coarse_levels,
                    "levels of twice the voxel size, and so on, that the flow passes first; auto: 1 for a sphere or a "
                    "box, else 0")
        ->check(CLI::Range(0, 4).description(""))
        ->type_name("N")
        ->default_str("auto");
    bricks.bind(command);
    checkpoint.bind(command);
    if (!with_image) {
        in_group(command, Group::Clouds);
        add_choice(command, "--holes", holes.policy,
                   {{"close", Holes::Close}, {"open", Holes::Open}, {"flat", Holes::Flat}},
                   "where no points are, the surface goes on smoothly, or the mesh ends (the level set stays closed), "
                   "or the flattest patch spans it, in both");
        add_length(command, "--hole-distance", hole_distance, "",
                   "a hole is where the surface lies farther from all points [3 spacings where they are sparse, at "
                   "least 3vx]");
    }
    in_group(command, Group::MeshFiles);
    add_length(command, "--min-component", min_component, "",
               "drop pieces of the mesh that are smaller than a cube of this edge");
    vdb.bind(command);
    mesh.bind(command);
    mesh.bind_plain(command);
    if (with_image) image.bind(command, false, false);
}

Image SegmentJob::read(const std::string& path, const ReadImageOptions& options, Session& session) const {
    const Stopwatch reading;
    ReadImageOptions needed = options;
    if (domain.roi) {
        const Vec3 spacing = read_image_geometry(path, options, session.run()).spacing;
        const double finest = *std::min_element(spacing.begin(), spacing.end());
        needed.roi = sampled_box(*domain.roi, domain.voxel_size.resolve(finest, finest));
    }
    session.require_memory(double(read_image_info(path, needed, session.run()).bytes_to_hold), "the image");
    Image pixels = read_image(path, needed, session.run());
    session.set_world(pixels.geometry());
    Json& input = session.report()["input"]["image"];
    input = to_json(pixels.geometry());
    input["path"] = path;
    session.add_seconds("read", reading.seconds());
    return pixels;
}

void SegmentJob::tell_chunks(const Image& image, Session& session) {
    const std::optional<ChunkCount> chunks = image.chunks();
    if (!chunks) return;
    session.report()["input"]["image"]["chunks"] = to_json(*chunks);
    session.note("read " + std::to_string(chunks->read) + " of " + std::to_string(chunks->total) +
                 " chunks of the image");
}

void SegmentJob::run(Session& session) const {
    const auto has_name = [](const std::string& text) { return !split_name(text).name.empty(); };
    bool names = false;
    for (const std::vector<std::string>* texts : {&points.paths, &contours.paths, &seeds.inside, &seeds.outside})
        names = names || std::any_of(texts->begin(), texts->end(), has_name);
    if (names && images.empty())
        throw UsageError("expected files without names: several structures need an image, see covol segment");
    if (images.empty()) session.set_world_of_points();
    if (session.is_planning()) return run_plan(*this, session);
    if (checkpoint.given() && (session.brick() || is_timelapse(*this)))
        throw UsageError(
            "--checkpoint, --resume: bricks and the frames of a time-lapse are put in place one by one, and gone on "
            "with");
    if (session.brick()) return run_bricks(*this, session);
    if (is_timelapse(*this)) return run_timelapse(*this, session);
    checkpoint.begin(session);
    run_structures(*this, session, [&](const Image* image, const PreparedStructure& structure, const RunContext& run) {
        return solve_within_limit(*this, image, structure, session, run);
    });
}

}  // namespace covol::tool
