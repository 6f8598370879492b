#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "cli/output/report.h"
#include "cli/shear.h"
#include "commands/commands.h"
#include "covol/file_kind.h"
#include "covol/safe_text.h"
#include "covol/vdb_io.h"
#include "flags/bindings.h"

namespace covol::tool {
namespace {

std::string triple(const auto& v) {
    std::ostringstream text;
    text << v[0] << " x " << v[1] << " x " << v[2];
    return text.str();
}

const char* name_of(PointSpace space) {
    switch (space) {
        case PointSpace::Index: return "index";
        case PointSpace::Local: return "local";
        case PointSpace::Slices: return "slices";
        default: return "world";
    }
}

void describe_vdb(const std::string& path, Session& session) {
    Json& grids = session.report()["grids"] = Json::array();
    for (const VdbGridInfo& g : list_vdb(path)) {
        session.print(safe_text(g.name + ": " + g.type + ", " + (g.grid_class.empty() ? "no class" : g.grid_class)) +
                      ", " + std::to_string(g.active_voxels) + " active voxels of " + std::to_string(g.voxel_size) +
                      (g.uniform ? "" : " (not uniform)") + ", " + triple(g.min) + " to " + triple(g.max));
        grids.push_back({{"name", g.name},
                         {"type", g.type},
                         {"class", g.grid_class},
                         {"voxel_size", g.voxel_size},
                         {"uniform", g.uniform},
                         {"active_voxels", g.active_voxels},
                         {"min", {g.min[0], g.min[1], g.min[2]}},
                         {"max", {g.max[0], g.max[1], g.max[2]}},
                         {"metadata", g.metadata}});
    }
}

/// The direction of an image axis in the world as text: "+x", or its direction cosines.
std::string axis_text(const ImageGeometry& g, int axis) {
    for (int w = 0; w < 3; ++w)
        if (std::abs(g.direction[w][axis]) > 1 - 1e-6)
            return std::string(g.direction[w][axis] > 0 ? "+" : "-") + "xyz"[w];
    std::ostringstream text;
    text << std::setprecision(3) << "(" << g.direction[0][axis] << ", " << g.direction[1][axis] << ", "
         << g.direction[2][axis] << ")";
    return text.str();
}

/// Whether the range of values is found from some slices only, as for large mapped files.
bool is_range_of_slices(const ImageInfo& info) { return info.bytes_to_hold == 0 && info.chunk_size[0] == 0; }

/// Minimum and maximum value of one channel; an estimate for large files.
Json range_of(const std::string& path, ReadImageOptions options, int channel, const ImageInfo& info, Session& session) {
    options.channel = channel;
    const int frame = options.frame.value_or(0);
    if (info.frames > 1) options.frame = frame;
    const Image image = read_image(path, options, session.run());
    const auto range = image.range();
    const std::optional<ChunkCount> chunks = image.chunks();
    const bool named = std::size_t(channel) < info.channel_names.size();
    std::ostringstream text;
    text << (info.channels > 1 ? "channel " + std::to_string(channel) +
                                     (named ? " " + safe_text(info.channel_names[channel]) : "") + ": "
                               : "values: ")
         << range[0] << " to " << range[1] << (info.frames > 1 ? ", frame " + std::to_string(frame) : "");
    const bool of_chunks = chunks && chunks->read < chunks->total, of_slices = is_range_of_slices(info);
    if (of_chunks) text << ", of " << chunks->read << " of " << chunks->total << " chunks";
    if (of_slices) text << ", of slices spread over the file";
    if (of_chunks || of_slices) text << ": an estimate";
    session.print(text.str());
    session.report()["image"]["range_is_estimate"] = of_chunks || of_slices;
    return {range[0], range[1]};
}

void describe_image(const std::string& path, const ImageFlags& flags, Session& session) {
    constexpr int kMaxChannels = 16;  // ranges of values are computed for this many channels only
    const ImageInfo info = read_image_info(path, flags.options, session.run());
    const ImageGeometry& g = info.geometry;
    std::ostringstream text;
    text << safe_text(info.format) << ", " << triple(g.size) << " voxels, " << to_string(info.type) << ", "
         << info.channels << " channel(s), " << info.frames << " frame(s), stored as " << info.axis_order
         << "\nspacing " << triple(g.spacing) << " " << (g.unit.empty() ? "(no unit)" : safe_text(g.unit))
         << (g.spacing_known ? "" : " (not known)") << ", origin " << triple(g.origin) << "\naxes: i runs along "
         << axis_text(g, 0) << ", j along " << axis_text(g, 1) << ", k along " << axis_text(g, 2)
         << " of the world (LPS), which goes from " << triple(g.world_box().min) << " to " << triple(g.world_box().max);
    if (const double shear = shear_of(g); shear > 0)
        text << "\nsheared: the angles between its axes differ from 90 degrees by up to " << std::setprecision(3)
             << shear << std::setprecision(6);
    const bool in_chunks = info.chunk_size[0] > 0;
    if (in_chunks) text << "\nchunks of " << triple(info.chunk_size) << " voxels";
    for (const std::string& level : info.levels) text << "\nlevel " << safe_text(level);
    for (const auto& [field, value] : info.fields) text << "\n  " << safe_text(field) << ": " << safe_text(value);
    session.print(text.str());

    Json& report = session.report()["image"] = to_json(g);
    report["format"] = info.format;
    report["type"] = to_string(info.type);
    report["axis_order"] = info.axis_order;
    report["channels"] = info.channels;
    report["channel_names"] = info.channel_names;
    report["frames"] = info.frames;
    if (in_chunks) report["chunk_size"] = info.chunk_size;
    if (!info.levels.empty()) report["levels"] = info.levels;
    report["spacing_known"] = {info.spacing_known[0], info.spacing_known[1], info.spacing_known[2]};
    for (const auto& [field, value] : info.fields) report["fields"][field] = value;
    const int first = flags.options.channel.value_or(0);
    const int last = flags.options.channel ? first : std::min(info.channels, kMaxChannels) - 1;
    for (int channel = first; channel <= last; ++channel) {
        const Json range = range_of(path, flags.options, channel, info, session);
        if (channel == first) report["range"] = range;
        report["ranges"].push_back(range);
    }
}

void describe_mesh(const std::string& path, Session& session) {
    const TriangleMesh mesh = read_mesh(path);
    const MeshMeasures measures = measure(mesh);
    session.print(std::to_string(mesh.vertices.size()) + " vertices, " + std::to_string(mesh.triangles.size()) +
                  " triangles\n" + one_line(measures));
    session.report()["mesh"] = to_json(measures);
    session.report()["mesh"]["vertices"] = mesh.vertices.size();
    session.report()["mesh"]["triangles"] = mesh.triangles.size();
}

void describe_points(const std::string& path, const PointFlags& flags, Session& session) {
    const PointCloud cloud = read_points(path, flags.options);
    const WorldBox box = bounding_box(cloud.points);
    const std::vector<Vec3> distinct = merge_close_points(cloud.points, 0);
    std::ostringstream text;
    const auto closed =
        std::count_if(cloud.lines.begin(), cloud.lines.end(), [](const MarkLine& l) { return l.closed; });
    text << cloud.points.size() << " points, " << distinct.size() << " distinct, " << safe_text(cloud.rule);
    if (!cloud.lines.empty()) text << "\n" << cloud.lines.size() << " lines, " << closed << " of them closed";
    text << "\nfrom " << triple(box.min) << " to " << triple(box.max);
    Json& report = session.report()["points"];
    report = {{"count", cloud.points.size()},
              {"distinct", distinct.size()},
              {"rule", cloud.rule},
              {"lines", {{"count", cloud.lines.size()}, {"closed", closed}}},
              {"space", name_of(cloud.space)},
              {"box", to_json(box)}};
    if (distinct.size() > 1) {
        const SpacingStatistics s = measure_spacing(distinct);
        text << "\ndistance to the nearest other point: median " << s.median << ", mean " << s.mean << ", 95 % "
             << s.p95 << ", max " << s.max;
        report["spacing"] = {{"median", s.median}, {"mean", s.mean}, {"p95", s.p95}, {"max", s.max}};
    }
    session.print(text.str());
}

void describe(const std::string& path, const ImageFlags& flags, const PointFlags& points, Session& session) {
    // A named grid (FILE.vdb:NAME) is described as an image, because options such as --image would read it as one.
    const FileKind kind = split_grid_name(path).grid.empty() ? kind_of_file(path) : FileKind::Image;
    session.report()["kind"] = to_string(kind);
    switch (kind) {
        case FileKind::Vdb: return describe_vdb(path, session);
        case FileKind::Image: return describe_image(path, flags, session);
        case FileKind::Mesh: return describe_mesh(path, session);
        case FileKind::Points: return describe_points(path, points, session);
    }
}

}  // namespace

void add_info(Session& session) {
    const auto path = std::make_shared<std::string>();
    const auto flags = std::make_shared<ImageFlags>();
    const auto points = std::make_shared<PointFlags>();
    CLI::App* command =
        session.add_command("info", "Show what a file contains: .vdb, image, mesh or points",
                            [path, flags, points, &session] { describe(*path, *flags, *points, session); });
    in_group(*command, Group::Input);
    command->add_option("file", *path, "the file")->required()->type_name("FILE");
    flags->bind(*command);
    points->bind_options(*command);
}

}  // namespace covol::tool
