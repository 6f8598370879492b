#include "flags/bindings.h"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include "covol/error.h"
#include "covol/file_kind.h"
#include "covol/mesh_stream.h"

namespace covol::tool {

bool is_offered(const OptionInfo& option, Offered job) {
    const Offered offered = option.place.offered;
    return option.place.group != Group::None &&
           (offered == Offered::Always || offered == job || job == Offered::SingleStep);
}

CLI::Option* add_length(CLI::App& command, const OptionInfo& option, const std::function<void(const Length&)>& take) {
    const std::string flag = flag_of(option.name);
    return command
        .add_option_function<std::string>(
            flag,
            [take, flag, range = option.range](const std::string& text) {
                const Length length = parse_length(flag, text);
                range.require(flag, length.value);
                take(length);
            },
            option.text)
        ->type_name("LENGTH");
}

CLI::Option* add_vec3(CLI::App& command, const OptionInfo& option, const std::function<void(const Vec3&)>& take) {
    const std::string flag = flag_of(option.name);
    return command
        .add_option_function<std::vector<std::string>>(
            flag,
            [take, flag, range = option.range](const std::vector<std::string>& texts) {
                for (const std::string& text : texts) {
                    const Vec3 value = parse_vec3(flag, text);
                    for (const double x : value) range.require(flag, x);
                    take(value);
                }
            },
            option.text)
        ->type_name("X,Y,Z")
        ->allow_extra_args(false);
}

CLI::Option* add_box(CLI::App& command, const OptionInfo& option, const std::function<void(const WorldBox&)>& take) {
    const std::string flag = flag_of(option.name);
    return command
        .add_option_function<std::string>(
            flag, [take, flag](const std::string& text) { take(parse_box(flag, text)); }, option.text)
        ->type_name("X0,Y0,Z0,X1,Y1,Z1");
}

CLI::Option* add_words(CLI::App& command, const OptionInfo& option, const std::vector<std::string>& words,
                       const std::function<void(std::size_t)>& take) {
    std::vector<std::string> known;
    std::string names;
    for (const std::string& word : words)
        if (!word.empty()) {
            known.push_back(word);
            names += (names.empty() ? "" : "|") + word;
        }
    return command
        .add_option_function<std::string>(
            flag_of(option.name),
            [take, words](const std::string& word) {
                take(std::size_t(std::find(words.begin(), words.end(), CLI::detail::to_lower(word)) - words.begin()));
            },
            option.text)
        ->check(CLI::IsMember(known, CLI::ignore_case).description(""))
        ->type_name(names);
}

// ---- images and points ---------------------------------------------------------------------------------------------

Image ImageFlags::read(const std::string& path, const RunContext& run) const {
    const Image image = read_image(path, options, run);
    return options.roi ? image.cropped() : image;
}

ImageGeometry ImageFlags::read_geometry(const std::string& path, const RunContext& run) const {
    const ImageGeometry geometry = read_image_geometry(path, options, run);
    return options.roi ? cropped(geometry, voxels_around(geometry, *options.roi)) : geometry;
}

WorldBox sampled_box(const WorldBox& box, double h) {
    constexpr double kReach = 9;  // voxels: up to 7 to complete a leaf, 1 for rounding the box to voxels, 1 as a margin
    WorldBox grown = box;
    for (int a = 0; a < 3; ++a) {
        grown.min[a] -= kReach * h;
        grown.max[a] += kReach * h;
    }
    return grown;
}

CLI::Option* PointFlags::bind(CLI::App& command, const std::string& flag) {
    in_group(command, Group::Marks);
    CLI::Option* option =
        command
            .add_option(flag, paths,
                        "points: XYZ, CSV, PLY, OBJ, OFF, PCD, LAS; marks of Fiji, napari, 3D Slicer, ITK-SNAP")
            ->type_name("FILE...");
    bind_options(command);
    return option;
}

namespace {

/// The whole content of standard input, which the first call reads. Waits for the writing program unless cancelled.
const std::string& standard_input(const RunContext& run) {
    static std::string text;
    static bool done = false;
    std::vector<char> piece(1 << 16);
    while (!done) {
        pollfd ready{STDIN_FILENO, POLLIN, 0};
        constexpr int kPause = 50;                          // milliseconds
        const bool waits = ::poll(&ready, 1, kPause) <= 0;  // no data yet, or a signal arrived
        run.check();
        if (waits) continue;
        const ssize_t got = ::read(STDIN_FILENO, piece.data(), piece.size());
        if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
        if (got < 0) throw Error(Errc::Io, std::string("standard input: cannot read: ") + std::strerror(errno));
        text.append(piece.data(), std::size_t(got));
        done = got == 0;
    }
    return text;
}

}  // namespace

ReadMarksOptions reading_of(const PointFlags& flags, const RunContext& run) {
    ReadMarksOptions reading;
    reading.points = flags.options;
    reading.standard_input = [run]() -> const std::string& { return standard_input(run); };
    return reading;
}

std::vector<Vec3> read_world_points(const PointFlags& flags, const std::optional<ImageGeometry>& geometry,
                                    const RunContext& run) {
    Marks marks;
    marks.files.points = flags.paths;
    read_marks(marks, geometry, reading_of(flags, run), run);
    return marks.points;
}

// ---- model ---------------------------------------------------------------------------------------------------------

double resolve_voxel_size(const Length& requested, const Image* image, const std::vector<Vec3>& points, bool tagged,
                          Session& session) {
    if (requested.given && !requested.in_voxels) return requested.value;
    const VoxelSizeChoice choice = image != nullptr ? choose_voxel_size(*image) : choose_voxel_size(points, tagged);
    const double h = requested.resolve(choice.voxel_size, choice.voxel_size);
    const std::string line =
        to_text(h) + " (" + (requested.given ? to_text(requested.value) + " times " : "") + choice.reason + ")";
    session.note("voxel_size: " + line);
    session.report()["automatic"]["voxel_size"] = line;
    return h;
}

// ---- results -------------------------------------------------------------------------------------------------------

void MeshFlags::bind(CLI::App& command) {
    in_group(command, Group::MeshFiles);
    command
        .add_option_function<std::string>(
            "--up", [this](const std::string& text) { options.y_up = text == "y"; },
            "axis of the mesh that points up [z; in .glb y, as glTF requires]")
        ->check(CLI::IsMember({"y", "z"}).description(""))
        ->type_name("y|z");
    tool::bind_options(command, *this, Offered::SingleStep);
}

void MeshFlags::bind_plain(CLI::App& command) {
    in_group(command, Group::MeshFiles);
    command.add_flag("--plain", plain,
                     "triangles of marching cubes, neither relaxed nor held in memory: for surfaces of tens of "
                     "millions of triangles; .ply, .stl, .obj");
}

void MeshFlags::check_plain(const std::string& path) const {
    if (plain && !path.empty() && !can_stream_mesh(path))
        throw UsageError("--plain: expected a mesh with .ply, .stl or .obj, got " + path);
}

void MeshFlags::check_used(bool writes) const {
    if (!writes && (options.y_up || has("unit_scale")))
        throw UsageError(std::string(options.y_up ? "--up" : "--unit-scale") +
                         ": it applies to meshes only, and this run writes none; write a mesh, or leave it out");
}

WriteMeshOptions MeshFlags::write_options(const Session& session) const {
    WriteMeshOptions write = options;
    write.comments = session.provenance().comments();
    write.warn = [run = session.run()](const std::string& line) { run.warn(line); };
    return write;
}

void check_label(const std::string& flag, int label, const std::string& path) {
    if (label < 1 || label > 255)
        throw Error(Errc::InvalidOptions, flag + ": expected 1 to 255, got " + std::to_string(label));
    if (label != 1 && long_ending(path) == ".dcm")
        throw UsageError(flag + ": expected 1 for " + path + ", because segments of DICOM are numbered from 1, got " +
                         std::to_string(label) + "; leave it out, or write a .nrrd or .nii.gz");
}

bool is_float_grid(const VdbGridInfo& grid) {
    return grid.type == "Tree_float_5_4_3" || grid.type == "Tree_float_5_4_3_HalfFloat";
}

}  // namespace covol::tool
