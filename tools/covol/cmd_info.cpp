#include <algorithm>
#include <iomanip>
#include <sstream>

#include "bindings.h"
#include "commands.h"
#include "covol/vdb_io.h"
#include "file_kind.h"
#include "report.h"

namespace covol::tool {
namespace {

std::string triple(const auto& v) {
    std::ostringstream text;
    text << v[0] << " x " << v[1] << " x " << v[2];
    return text.str();
}

const char* name_of(PixelType type) {
    switch (type) {
        case PixelType::UInt8: return "uint8";
        case PixelType::Int8: return "int8";
        case PixelType::UInt16: return "uint16";
        case PixelType::Int16: return "int16";
        case PixelType::UInt32: return "uint32";
        case PixelType::Int32: return "int32";
        case PixelType::Float: return "float";
        case PixelType::Double: break;
    }
    return "double";
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
        session.say(g.name + ": " + g.type + ", " + (g.grid_class.empty() ? "no class" : g.grid_class) + ", " +
                    std::to_string(g.active_voxels) + " active voxels of " + std::to_string(g.voxel_size) +
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

void describe_image(const std::string& path, Session& session) {
    const Image image = read_image(path, {}, session.run());
    const ImageGeometry& g = image.geometry();
    const auto range = image.range();
    std::ostringstream text;
    text << triple(g.size) << " voxels, " << name_of(image.pixel_type()) << ", " << range[0] << " to " << range[1]
         << "\nspacing " << triple(g.spacing) << " " << (g.unit.empty() ? "(no unit)" : g.unit) << ", origin "
         << triple(g.origin) << (g.is_axis_aligned() ? "" : ", rotated");
    session.say(text.str());
    session.report()["image"] = to_json(g);
    session.report()["image"]["type"] = name_of(image.pixel_type());
    session.report()["image"]["range"] = {range[0], range[1]};
}

void describe_mesh(const std::string& path, Session& session) {
    const TriangleMesh mesh = read_mesh(path);
    const MeshMeasures measures = measure(mesh);
    session.say(std::to_string(mesh.vertices.size()) + " vertices, " + std::to_string(mesh.triangles.size()) +
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
    const auto closed = std::count_if(cloud.lines.begin(), cloud.lines.end(), [](const MarkLine& l) { return l.closed; });
    text << cloud.points.size() << " points, " << distinct.size() << " distinct, " << cloud.rule;
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
        const SpacingStatistics s = nearest_neighbour_spacing(distinct);
        text << "\ndistance to the nearest other point: median " << s.median << ", mean " << s.mean << ", 95 % " << s.p95
             << ", max " << s.max;
        report["spacing"] = {{"median", s.median}, {"mean", s.mean}, {"p95", s.p95}, {"max", s.max}};
    }
    session.say(text.str());
}

void describe(const std::string& path, const PointFlags& points, Session& session) {
    const FileKind kind = kind_of_file(path);
    session.report()["kind"] = to_string(kind);
    switch (kind) {
        case FileKind::Vdb: return describe_vdb(path, session);
        case FileKind::Image: return describe_image(path, session);
        case FileKind::Mesh: return describe_mesh(path, session);
        case FileKind::Points: return describe_points(path, points, session);
    }
}

}  // namespace

void add_info(Session& session) {
    const auto path = std::make_shared<std::string>();
    const auto points = std::make_shared<PointFlags>();
    CLI::App* command = session.add_command("info", "What is in a file: .vdb, image, mesh or points",
                                            [path, points, &session] { describe(*path, *points, session); });
    command->add_option("file", *path, "the file")->required()->type_name("FILE");
    points->bind_options(*command);
}

}  // namespace covol::tool
