#include "flags/bindings.h"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include "covol/error.h"
#include "covol/mesh_stream.h"
#include "covol/points_text.h"

namespace covol::tool {
namespace {

void add_box(CLI::App& command, const std::string& flag, std::optional<WorldBox>& target,
             const std::string& description) {
    command
        .add_option_function<std::string>(
            flag, [&target, flag](const std::string& text) { target = parse_box(flag, text); }, description)
        ->type_name("X0,Y0,Z0,X1,Y1,Z1");
}

template <typename Number>
CLI::Option* add_positive(CLI::App& command, const std::string& flag, Number& target, const std::string& description) {
    CLI::Option* option = command.add_option_function<double>(
        flag,
        [&target, flag](const double& value) {
            if (!(value > 0) || !std::isfinite(value))
                throw Error(Errc::InvalidOptions, flag + ": expected > 0, got " + to_text(value));
            target = value;
        },
        description);
    return option->type_name("NUMBER");
}

/// An optional weight; the library's own mark of "automatic", a negative number, is not for the command line.
void add_share(CLI::App& command, const std::string& flag, std::optional<double>& target,
               const std::string& description) {
    command
        .add_option_function<double>(
            flag,
            [&target, flag](const double& value) {
                if (!(value >= 0 && value <= 1))
                    throw Error(Errc::InvalidOptions, flag + ": expected 0 to 1, got " + to_text(value));
                target = value;
            },
            description)
        ->type_name("FLOAT");
}

}  // namespace

std::string to_text(double value) {
    std::ostringstream text;
    text << value;
    return text.str();
}

CLI::Option* add_length(CLI::App& command, const std::string& flag, Length& target, const std::string& shown_default,
                        const std::string& description) {
    CLI::Option* option = command.add_option_function<std::string>(
        flag, [&target, flag](const std::string& text) { target = parse_length(flag, text); }, description);
    return option->type_name("LENGTH")->default_str(shown_default);
}

void add_vec3(CLI::App& command, const std::string& flag, std::vector<Vec3>& target, const std::string& description) {
    command
        .add_option_function<std::vector<std::string>>(
            flag,
            [&target, flag](const std::vector<std::string>& texts) {
                target.clear();
                for (const std::string& text : texts) target.push_back(parse_vec3(flag, text));
            },
            description)
        ->type_name("X,Y,Z")
        ->allow_extra_args(false);
}

// ---- images and points ---------------------------------------------------------------------------------------------

void ImageFlags::bind(CLI::App& command, bool with_roi, bool with_frame) {
    in_group(command, Group::Input);
    command
        .add_option_function<std::string>(
            "--spacing",
            [this](const std::string& text) {
                options.spacing = parse_vec3("--spacing", text);
                for (const double s : options.spacing)
                    if (!(s > 0))
                        throw Error(Errc::InvalidOptions, "--spacing: expected three numbers > 0, got " + text);
            },
            "voxel spacing, instead of the file's")
        ->type_name("SX,SY,SZ");
    const auto add_index = [&](const char* flag, int& target, const char* description) {
        command.add_option(flag, target, description)->check(CLI::NonNegativeNumber.description(""))->type_name("N");
    };
    add_index("--channel", options.channel, "channel of an image that has several, from 0");
    if (with_frame) add_index("--frame", options.frame, "time point of an image that has several, from 0");
    if (with_roi) add_box(command, "--roi", options.roi, "take this box of the world only");
    command.add_flag("--correct-level-shift", options.correct_level_shift,
                     "move a coarse level of an OME-Zarr image that states no translation onto the finest one");
}

Image ImageFlags::read(const std::string& path, const RunContext& run) const {
    const Image image = read_image(path, options, run);
    return options.roi ? image.cropped() : image;
}

ImageGeometry ImageFlags::read_geometry(const std::string& path, const RunContext& run) const {
    const ImageGeometry geometry = read_image_geometry(path, options, run);
    return options.roi ? cropped(geometry, voxels_around(geometry, *options.roi)) : geometry;
}

WorldBox sampled_box(const WorldBox& box, double h) {
    constexpr double kReach = 9;  // a leaf's 7 voxels, one for rounding the box up to voxels, one to spare
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

void PointFlags::bind_options(CLI::App& command) {
    in_group(command, Group::ReadingMarks);
    add_choice(command, "--points-space", options.space,
               {{"world", PointSpace::World},
                {"ras", PointSpace::Ras},
                {"index", PointSpace::Index},
                {"index1", PointSpace::IndexOne},
                {"local", PointSpace::Local}},
               "coordinates are world units (LPS), the same in RAS, voxels from 0, voxels from 1, or lengths from the "
               "first voxel [what the format says, else world]");
    add_choice(command, "--points-order", options.order, {{"xyz", PointOrder::XYZ}, {"zyx", PointOrder::ZYX}},
               "order of the coordinates [what the format says, else xyz]");
    add_positive(command, "--points-scale", options.scale,
                 "multiplies the points' lengths, 0.001 for micrometres to mm");
    command
        .add_option("--points-channels", options.channels,
                    "channels of the hyperstack that a Fiji multi-point was clicked in")
        ->check(CLI::Range(1, 1000).description(""))
        ->type_name("N");
}

namespace {

/// All of it; it is there once. Whoever writes it may take long.
const std::string& standard_input(const RunContext& run) {
    static std::string text;
    static bool done = false;
    std::vector<char> piece(1 << 16);
    while (!done) {
        pollfd ready{STDIN_FILENO, POLLIN, 0};
        constexpr int kPause = 50;                          // milliseconds
        const bool waits = ::poll(&ready, 1, kPause) <= 0;  // or a signal came
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

WorldPoints read_world_points(const PointFlags& flags, const ImageGeometry* geometry, const RunContext& run) {
    WorldPoints all;
    for (const std::string& path : flags.paths) {
        run.check();
        const PointCloud cloud = path == "-" ? parse_points(standard_input(run), "standard input", flags.options)
                                             : read_points(path, flags.options);
        if (!cloud.lines.empty())
            run.warn(path + ": its marks form " + std::to_string(cloud.lines.size()) +
                     " lines, and are taken as loose points here; --contours joins them along the lines");
        add_cloud(cloud, geometry, all, run);
        run.info(path + ": " + std::to_string(cloud.points.size()) + " points" +
                 (cloud.rule.empty() ? "" : ", " + cloud.rule));
    }
    return all;
}

// ---- model ---------------------------------------------------------------------------------------------------------

void DomainFlags::bind(CLI::App& command, bool with_margin) {
    in_group(command, Group::Domain);
    add_length(command, "--voxel-size", voxel_size, "",
               "edge of the voxels [the image's smallest spacing; without an image from the points]");
    add_box(command, "--roi", roi, "work in this box of the world only");
    command
        .add_option_function<std::string>(
            "--lattice-origin",
            [this](const std::string& text) { lattice_origin = parse_vec3("--lattice-origin", text); },
            "centre of voxel (0,0,0): runs with the same voxel size and origin share their lattice [the image's; "
            "without an image 0,0,0]")
        ->type_name("X,Y,Z");
    if (with_margin)
        add_length(command, "--margin", margin, "", "between the points and the domain's boundary [D + 6vx]");
}

double DomainFlags::resolve_voxel_size(const Image* image, const std::vector<Vec3>& points, bool tagged,
                                       Session& session) const {
    if (voxel_size.given && !(voxel_size.value > 0))
        throw Error(Errc::InvalidOptions, "--voxel-size: expected > 0, got " + to_text(voxel_size.value));
    if (voxel_size.given && !voxel_size.in_voxels) return voxel_size.value;
    const VoxelSizeChoice choice = image != nullptr ? choose_voxel_size(*image) : choose_voxel_size(points, tagged);
    const double h = voxel_size.resolve(choice.voxel_size, choice.voxel_size);
    const std::string line =
        to_text(h) + " (" + (voxel_size.given ? to_text(voxel_size.value) + " times " : "") + choice.reason + ")";
    session.note("voxel_size: " + line);
    session.report()["automatic"]["voxel_size"] = line;
    return h;
}

void TagFlags::bind(CLI::App& command, bool names) {
    in_group(command, Group::Start);
    add_length(command, "--tag-distance", tag_distance, "", "D: closes gaps between points up to 2D [from the points]");
    const std::string flag = "--exterior-seed", what = "a position outside the structure, also in a cavity; repeatable";
    if (!names) return add_vec3(command, flag, exterior_seeds, what);
    command
        .add_option_function<std::vector<std::string>>(
            flag,
            [this, flag](const std::vector<std::string>& texts) {
                exterior_seeds.clear();
                named_seeds.clear();
                for (const std::string& text : texts) {
                    const std::size_t colon = text.find(':');
                    if (colon == std::string::npos)
                        exterior_seeds.push_back(parse_vec3(flag, text));
                    else
                        named_seeds.emplace_back(text.substr(0, colon), parse_vec3(flag, text.substr(colon + 1)));
                }
            },
            what + "; with NAME: of that structure alone")
        ->type_name("[NAME:]X,Y,Z")
        ->allow_extra_args(false);
}

void EdgeFlags::bind(CLI::App& command, bool alone) {
    in_group(command, Group::Edges);
    add_length(command, "--sigma", sigma, "",
               std::string("presmoothing of the image ") + (alone ? "[1vx]" : "[2vx after tagging, else 1vx]"));
    add_choice(command, "--edge-feature", options.feature,
               {{"auto", EdgeFeature::Automatic},
                {"slope", EdgeFeature::Slope},
                {"bright-line", EdgeFeature::BrightLine},
                {"dark-line", EdgeFeature::DarkLine}},
               std::string(
                   "what edges are: borders between darker and brighter, or bright or dark sheets such as membranes ") +
                   (alone ? "[slope]" : "[what the marks of contours lie on, else slope]"));
    CLI::Option* k = add_positive(command, "--edge-k", options.edge_k, "K in g = 1/(1 + K s^2) [see --edge-contrast]");
    add_positive(command, "--edge-contrast", options.edge_contrast,
                 "gradient, per world unit, or brightness of lines at which g = 1/2, of the image scaled to [0,1] [90 "
                 "% percentile in the band, for lines a third of the median]")
        ->excludes(k);
}

EdgeOptions EdgeFlags::resolve(double h) const {
    EdgeOptions resolved = options;
    resolved.sigma = sigma.resolve(h);
    return resolved;
}

void EvolveFlags::bind(CLI::App& command, bool with_image, bool alone) {
    in_group(command, Group::Flow);
    command.add_option("--theta", options.theta, "weight of the points, 0 to 1")->capture_default_str();
    if (with_image) command.add_option("--rho", options.rho, "weight of the image, 0 to 1")->capture_default_str();
    add_length(command, "--delta", delta, "",
               std::string("weight of curvature ") + (alone ? "[1vx]" : "[0.5vx after tagging, else 1vx]"));
    add_length(command, "--tau", tau, "1vx and more", "time step; the flow's speed is 1 world unit per unit of time");
    in_group(command, Group::Numerics);
    command.add_option("--epsilon", options.epsilon, "regularises the norm of grad u")->capture_default_str();
    in_group(command, Group::Flow);
    add_length(command, "--attraction-range", attraction_range, "",
               std::string("points pull fully up to half of it, not at all beyond; 0: unlimited [") +
                   (alone        ? "0"
                    : with_image ? "after tagging 8vx, and 0 with --rho 0; else 5vx"
                                 : "0 after tagging, else 5vx") +
                   "]");
    if (with_image) {
        in_group(command, Group::Numerics);
        command.add_option("--edge-epsilon", options.edge_epsilon, "regularises the norm of grad g")
            ->capture_default_str();
        in_group(command, Group::Flow);
        add_share(command, "--image-yields", options.image_yields,
                  std::string("share of rho that fades close to points, on the attraction range's taper, 0 to 1 [") +
                      (alone ? "0" : "1 after tagging, else 0") + "]");
        add_share(command, "--guess-weight", guess_weight,
                  "share of theta that is left to what lies between marked slices, far from every mark, 0 to 1 [" +
                      to_text(options.guess_weight) + "]");
    }
    command.add_option("--max-steps", options.max_steps, "upper bound on time steps")->capture_default_str();
    command.add_option("--tolerance", options.tolerance, "steady below this mean change, in voxels a step of 1vx")
        ->capture_default_str();
    in_group(command, Group::Numerics);
    command.add_option("--solver-tolerance", options.solver_tolerance,
                       "a step's solve ends at this relative residual [0.001 with --tau, else 0.01]");
}

EvolveOptions EvolveFlags::resolve(double h) const {
    EvolveOptions resolved = options;
    resolved.delta = delta.resolve(h);
    resolved.tau = tau.resolve(h);
    resolved.attraction_range = attraction_range.resolve(h);
    resolved.guess_weight = guess_weight.value_or(options.guess_weight);
    return resolved;
}

// ---- results -------------------------------------------------------------------------------------------------------

void MeshFlags::bind(CLI::App& command) {
    in_group(command, Group::MeshFiles);
    command
        .add_option_function<std::string>(
            "--up", [this](const std::string& text) { y_up = text == "y"; },
            "the mesh's axis that points up [z; in .glb y, which glTF prescribes]")
        ->check(CLI::IsMember({"y", "z"}).description(""))
        ->type_name("y|z");
    command.add_option("--unit-scale", unit_scale, "multiplies the mesh's coordinates, 0.001 for mm to m")
        ->capture_default_str();
}

void MeshFlags::bind_plain(CLI::App& command) {
    in_group(command, Group::MeshFiles);
    command.add_flag("--plain", plain,
                     "triangles as marching cubes leave them, neither relaxed nor held in memory: for surfaces of tens "
                     "of millions of triangles; .ply, .stl, .obj");
}

void MeshFlags::check_plain(const std::string& path) const {
    if (plain && !path.empty() && !can_stream_mesh(path))
        throw UsageError("--plain: expected a mesh with .ply, .stl or .obj, got " + path);
}

void MeshFlags::check() const {
    if (!(unit_scale > 0) || !std::isfinite(unit_scale))
        throw Error(Errc::InvalidOptions, "--unit-scale: expected > 0, got " + to_text(unit_scale));
}

WriteMeshOptions MeshFlags::options(const Session& session) const {
    WriteMeshOptions write;
    write.y_up = y_up;
    write.unit_scale = unit_scale;
    write.comments = session.comments();
    write.warn = [run = session.run()](const std::string& line) { run.warn(line); };
    return write;
}

bool is_float_grid(const VdbGridInfo& grid) {
    return grid.type == "Tree_float_5_4_3" || grid.type == "Tree_float_5_4_3_HalfFloat";
}

}  // namespace covol::tool
