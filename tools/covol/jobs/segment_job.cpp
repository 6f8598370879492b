#include "jobs/segment_job.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "cli/options/option_names.h"
#include "cli/output/report.h"
#include "covol/file_kind.h"
#include "covol/study.h"
#include "jobs/brick_job.h"
#include "jobs/plan_job.h"
#include "jobs/structures_job.h"
#include "jobs/timelapse_job.h"

namespace covol::tool {

double SegmentJob::resolve_voxel_size(const Image* input_image, const Marks& marks,
                                      const std::optional<ImageGeometry>& geometry, Session& session) const {
    const bool tagged = !marks.contours.empty() || resolve(1).tags_points();
    return tool::resolve_voxel_size(given.length("voxel_size"), input_image,
                                    input_image != nullptr ? std::vector<Vec3>{} : positions_of(marks, geometry),
                                    tagged, session);
}

MarksOptions SegmentJob::marks_options(double h) const {
    return {contours.resolve(h), cloud.cleanup(h), image.has("spacing")};
}

ReadMarksOptions SegmentJob::reading(const RunContext& run) const {
    ReadMarksOptions options = reading_of(points, run);
    options.guess_label = guess.inputs.options.guess_label;
    options.force_geometry = image.has("spacing");
    return options;
}

SegmentOptions SegmentJob::resolve(double h) const {
    SegmentOptions options = given.resolve(h);
    options.voxel_size = h;
    options.voxel_size_may_grow = !given.has("voxel_size");
    options.keep_failed = !failed_path.empty();
    options.without_mesh = mesh.plain || !needs_mesh();
    options.without_fields = fields_path.empty() && !evidence.wanted();
    return options;
}

bool SegmentJob::needs_mesh() const {
    return !mesh_path.empty() || !page_path.empty() || !scene_path.empty() || evidence.wanted() ||
           covol::needs_mesh(given.options.holes.policy) || given.has("min_component");
}

void SegmentJob::check_options() const {
    check_settings();
    mesh.check_used(!mesh_path.empty());
}

void SegmentJob::check_settings() const {
    require_valid_flags(resolve(1.0));
    if (mask_label) check_label("--mask-label", *mask_label, mask_path);
    cloud.check();
    mesh.check_plain(mesh_path);
    if (mesh.plain && evidence.wanted())
        throw UsageError(
            "--plain: excludes --evidence, --suggest, --suggestions and --report, which need the whole mesh");
}

std::string SegmentJob::unused(const SegmentReport& report) const {
    if (report.solve.steps > 0 || report.solve.stop_reason != StopReason::Steady) return {};
    std::string flags;
    for (const char* name : {"delta", "tau", "attraction_range", "image_yields"})
        if (given.has(name)) flags += (flags.empty() ? "" : ", ") + flag_of(name);
    if (flags.empty()) return {};
    return flags +
           " had no effect: marks and image hold the surface at the guess, so there was no flow; --model paper has one";
}

void SegmentJob::sort_output(bool with_image) {
    const FileKind kind = output.empty() ? FileKind::Vdb : kind_of_output(output, FileKind::Mesh);
    const bool is_mask = kind == FileKind::Image && with_image && is_image_name(output);
    if (kind != FileKind::Mesh && !is_mask) return;  // `output` is kept, and must be a .vdb
    std::string& alone = is_mask ? mask_path : mesh_path;
    if (!alone.empty())
        throw UsageError("-o " + output + " and " + (is_mask ? "--mask " : "--mesh ") + alone +
                         ": expected only one of them; -o OUT.vdb can be combined with the others");
    alone = std::exchange(output, "");
}

void SegmentJob::take_study_options() {
    if (study.empty()) return;
    const StudyOptions own = read_study_options(study);
    const auto take_length = [&](const char* name, const std::optional<double>& value) {
        if (!value || given.has(name)) return;
        given.lengths[name] = {*value, false, true};
        given.names.insert(name);
    };
    take_length("voxel_size", own.voxel_size);
    take_length("mark_precision", own.mark_precision);
    if (own.rho && !given.has("rho")) {
        given.options.evolve.rho = *own.rho;
        given.names.insert("rho");
    }
    if (own.model && !given.has("model")) {
        given.options.model = *own.model;
        given.names.insert("model");
    }
}

void SegmentJob::find_image() {
    if (!images.empty()) return;
    if (study.empty()) throw UsageError("expected an image, or --study STUDY, got neither");
    images.push_back((std::filesystem::path(study) / read_study_image(study).path).lexically_normal().string());
}

std::string SegmentJob::any_output() const {
    for (const std::string* path : {&output, &mesh_path, &mask_path})
        if (!path->empty()) return *path;
    return {};
}

void SegmentJob::bind_named_seeds(CLI::App& command) {
    for_each_option(given.options, [&](const OptionInfo& option, auto& value) {
        if constexpr (std::is_same_v<std::remove_reference_t<decltype(value)>, std::vector<Vec3>>)
            command
                .add_option_function<std::vector<std::string>>(
                    flag_of(option.name),
                    [this, &value, flag = flag_of(option.name)](const std::vector<std::string>& texts) {
                        for (const std::string& text : texts) {
                            const std::size_t colon = text.find(':');
                            if (colon == std::string::npos)
                                value.push_back(parse_vec3(flag, text));
                            else
                                named_seeds.emplace_back(text.substr(0, colon),
                                                         parse_vec3(flag, text.substr(colon + 1)));
                        }
                    },
                    option.text + std::string("; with NAME: only for that structure"))
                ->type_name("[NAME:]X,Y,Z")
                ->allow_extra_args(false);
    });
}

void SegmentJob::bind(CLI::App& command, bool with_image) {
    in_group(command, Group::Output);
    command
        .add_option("-o,--output", output,
                    std::string("the surface as a level set, .vdb; or only ") +
                        (with_image ? "a mesh or a label image" : "a mesh") + ", depending on the file extension")
        ->required()
        ->type_name("OUT.vdb|...");
    command.final_callback([this, with_image] {
        if (with_image) find_image();
        if (with_image) take_study_options();
        sort_output(with_image);
    });
    if (with_image) {
        command
            .add_option(
                "--mask", mask_path,
                "label image with the geometry of the image; .seg.nrrd for 3D Slicer, .dcm for a DICOM segmentation")
            ->type_name("OUT.nrrd|.nii.gz|.tif|.mha|.zarr|.dcm");
        command
            .add_option(
                "--mask-label", mask_label,
                "value of the structure in --mask, 1 to 255; only for a single structure, and neither for a mask "
                "of --guess, which keeps its values, nor for .dcm, whose segments are numbered from 1 [1, or "
                "the painted label]")
            ->type_name("N");
        command
            .add_option("--rtstruct", rtstruct_path,
                        "contours of the surface on the image's slices, as a DICOM RT structure set")
            ->type_name("OUT.dcm");
        command.add_option("--table", table_path, "volume, area and fit of each structure and frame, as a table")
            ->type_name("OUT.csv");
        evidence.bind(command);
        in_group(command, Group::Input);
        command
            .add_option_function<std::string>(
                "--frame", [this](const std::string& text) { frames = parse_frames("--frame", text); },
                "time points of the image, counted from 0; each one after the first starts from the result of the "
                "previous one")
            ->type_name("all|N|A-B");
        in_group(command, Group::Output);
    }
    command
        .add_option("--mesh", mesh_path,
                    with_image ? "the surface as a closed, manifold mesh with outward normals"
                               : "the surface as a manifold mesh with outward normals; closed, unless --holes leaves "
                                 "it open")
        ->type_name("OUT.ply|.obj|.stl|.off|.glb");
    command.add_option("--density", density_path, kDensityHelp)->type_name("OUT.vdb");
    command
        .add_option("--usda", scene_path,
                    "scene in USD's text format that refers to the .vdb files, for a time-lapse frame by frame")
        ->type_name("OUT.usda");
    command.add_option("--fields", fields_path, "the grid u, and the grids distance and edge if the flow used them")
        ->type_name("OUT.vdb");
    command
        .add_option(
            "--report", page_path,
            "page for the browser: the surface in 3D, slices, measurements, options, and where new marks would help")
        ->type_name("OUT.html")
        ->each([this](const std::string&) { evidence.for_page = true; });
    command
        .add_option(
            "--keep-failed", failed_path,
            "if the run fails after its start was computed: the start, u, distance and edge, as far as they exist")
        ->type_name("OUT.vdb");
    contours.bind(command, with_image);
    if (with_image) {
        in_group(command, Group::ReadingMarks);
        command
            .add_option("--structure-column", structure_column,
                        "what names the structure of each mark in a file with several structures: a column, a group, "
                        "counter or type of Fiji, a label or node of 3D Slicer, a label of .csl sections, or the roi "
                        "of DICOM")
            ->type_name("NAME");
    }
    if (with_image) painted.bind(command);
    seeds.bind(command, with_image);
    if (with_image) guess.bind(command);
    cloud.bind(command, !with_image);
    const Offered offered = with_image ? Offered::WithImage : Offered::PointsAlone;
    if (with_image)
        bind_options(command, given, offered, {"exterior_seed"});
    else
        bind_options(command, given, offered);
    in_group(command, Group::Start);
    if (with_image) bind_named_seeds(command);
    command
        .add_option_function<std::string>(
            "--init",
            [this](const std::string& text) {
                const StartChoice choice = parse_start("--init", text);
                given.options.start = choice.start;
                start_path = choice.path;
            },
            "initial surface: auto, guess (surface of minimum bending energy through the marks), cloud (surface of "
            "many points, without an image), tag, sphere:x,y,z,r, box:x0,y0,z0,x1,y1,z1 (inside an object and without "
            "marks these grow to its edges), mesh:F, mask:F or vdb:F (with marks such a start is a guess that they "
            "correct in their neighbourhood)")
        ->type_name("START")
        ->default_str("auto");
    bricks.bind(command);
    checkpoint.bind(command);
    vdb.bind(command);
    mesh.bind(command);
    mesh.bind_plain(command);
    if (with_image) image.bind(command, {"roi", "frame"});
}

Image SegmentJob::read(const std::string& path, const ReadImageOptions& options, Session& session) const {
    const Stopwatch reading;
    ReadImageOptions needed = options;
    if (given.options.roi) {
        const double finest = read_image_geometry(path, options, session.run()).smallest_spacing();
        needed.roi = sampled_box(*given.options.roi, given.length("voxel_size").resolve(finest, finest));
    }
    session.require_memory(double(read_image_info(path, needed, session.run()).bytes_to_hold), "the image");
    Image pixels = read_image(path, needed, session.run());
    session.provenance().set_world(pixels.geometry());
    Json& input = session.report()["input"]["image"];
    input = to_json(pixels.geometry());
    input["path"] = path;
    session.add_seconds("read", reading.seconds());
    return pixels;
}

void SegmentJob::report_chunks(const Image& image, Session& session) {
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
        throw UsageError("expected files without names: several structures need an image; see covol segment");
    if (images.empty()) session.provenance().set_world_of_points();
    session.outputs().protect(images);  // the image may come from a study, not from the command line
    if (session.is_planning()) return run_plan(*this, session);
    if (checkpoint.given() && (session.brick() || is_timelapse(*this)))
        throw UsageError(
            "--checkpoint, --resume: not applicable to bricks and time-lapses, which are written one by one and "
            "continued from there");
    if (session.brick()) return run_bricks(*this, session);
    if (is_timelapse(*this)) return run_timelapse(*this, session);
    checkpoint.begin(session);
    run_structures(*this, session,
                   [&](const std::optional<Image>& pixels, const StructureInput& structure, const RunContext& run) {
                       return solve_within_limit(*this, pixels, structure, session, run);
                   });
}

}  // namespace covol::tool
