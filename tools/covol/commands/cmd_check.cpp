#include <algorithm>
#include <cmath>
#include <set>

#include "cli/options/option_names.h"
#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/error.h"
#include "covol/file_kind.h"
#include "covol/mesh_cleanup.h"
#include "covol/safe_text.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"
#include "flags/bindings.h"
#include "jobs/program_rules.h"

namespace covol::tool {
namespace {

constexpr double kFlatVoxels = 3;  // largest / smallest spacing; above it, most of a surface is interpolated
constexpr double kFarPoint = 20;   // nearest-neighbour distance of an outlier, divided by the median of all points

/// Collects what a file would cause in other programs: problems, which fail the check, and remarks, which do not.
class Findings {
public:
    Findings(Session& session, Program program) : facts{}, session_(session), program_(program) {
        session.report()["findings"] = Json::array();
    }
    FileFacts facts;  ///< properties of the file, by which advice_for() chooses its advice
    [[nodiscard]] Program program() const { return program_; }
    /// Whether no program was chosen. For a chosen program, its own rules replace the remarks on programs in general.
    [[nodiscard]] bool in_general() const { return program_ == Program::Any; }
    void problem(const std::string& text) {
        add("problem", text);
        ++problems_;
    }
    void remark(const std::string& text) { add("remark", text); }
    void advise(const Advice& advice) {
        add(advice.is_problem ? "problem" : "remark", advice.text, advice.remedy);
        if (advice.is_problem) ++problems_;
    }
    [[nodiscard]] int problems() const { return problems_; }

private:
    void add(const char* severity, const std::string& text, const std::string& remedy = {}) {
        session_.print(std::string(severity) + ": " + safe_text(text) + (remedy.empty() ? "" : "; " + remedy));
        Json finding{{"severity", severity}, {"text", text}};
        if (!remedy.empty()) finding["mend"] = remedy;
        session_.report()["findings"].push_back(finding);
    }
    Session& session_;
    Program program_;
    int problems_ = 0;
};

void check_extent(double extent, const std::string& what, Findings& findings) {
    findings.facts.extent = std::max(findings.facts.extent, extent);
    if (!findings.in_general()) return;
    if (extent > kFarClip)
        findings.remark(what + " is " + to_text(extent) +
                        " units wide: Blender and Houdini interpret a unit as a metre and clip it; write meshes with "
                        "--unit-scale, or scale the object");
    if (extent > 0 && extent < kNearClip)
        findings.remark(
            what + " is " + to_text(extent) +
            " units wide: Blender and Houdini interpret a unit as a metre and show a dot; write meshes with "
            "--unit-scale, or scale the object");
}

void check_measures(const TriangleMesh& mesh, const std::string& what, Findings& findings) {
    const MeshMeasures m = measure(mesh);
    findings.facts.is_closed = m.closed;
    // For printing, a rule in program_rules.cpp reports this, with the remedy.
    if (!m.closed && findings.program() != Program::Print)
        findings.problem(what + " is not closed: printing, volumes and Boolean operations fail");
    if (!m.manifold) findings.problem(what + " is not manifold: subdivision and simulation fail");
    if (m.closed && m.volume < 0) findings.problem(what + " is inside out: normals point inward");
    if (m.components > 1) findings.remark(what + " has " + std::to_string(m.components) + " pieces");
}

bool is_identifier(const std::string& name) {
    return !name.empty() && !std::isdigit(static_cast<unsigned char>(name.front())) &&
           std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_'; });
}

void check_level_set(const std::string& path, const VdbGridInfo& info, const RunContext& run, Findings& findings) {
    if (findings.in_general())
        findings.remark(
            "grid '" + info.name +
            "' is a level set: to render it as a volume, write a fog volume (--density) and give the renderer that");
    const FloatGridPtr grid = read_vdb(path, info.name);
    try {
        check_measures(extract_mesh(*grid, {}, run), "the surface of grid '" + info.name + "'", findings);
    } catch (const Error& error) {
        if (error.code() == Errc::Cancelled) throw;
        findings.problem("grid '" + info.name + "': " + with_flags(error.what()));
    }
}

void check_grid(const std::string& path, const VdbGridInfo& g, const RunContext& run, Findings& findings) {
    const std::string what = "grid '" + g.name + "'";
    if (!is_identifier(g.name))
        findings.remark(what + ": the name is not an identifier: expressions in Houdini and Blender cannot address it");
    if (!is_float_grid(g)) findings.remark(what + " holds " + g.type + ": covol and mesh tools read float grids only");
    if (g.active_voxels == 0) {
        findings.problem(what + " has no active voxel: nothing is drawn");
        return;
    }
    if (!g.uniform) findings.problem(what + " has voxels that are not cubes: level-set tools reject it");
    if (!g.metadata.contains("file_bbox_min"))
        findings.remark(what + " has no statistics metadata: viewers must load it to find its box");
    for (const auto& [key, value] : g.metadata)
        if (key == "creator" && value.starts_with("Houdini"))
            findings.remark(what + ": its creator is Houdini: importers may rotate its axes");
    FileFacts& facts = findings.facts;
    facts.has_level_set = facts.has_level_set || g.grid_class == "level set";
    facts.has_density = facts.has_density || (g.name == "density" && g.grid_class == "fog volume");
    facts.has_blosc = facts.has_blosc || g.compression == "blosc";
    facts.voxel_size = g.voxel_size;
    double extent = 0;
    for (int a = 0; a < 3; ++a) extent = std::max(extent, (double(g.max[a]) - g.min[a] + 1) * g.voxel_size);
    check_extent(extent, what, findings);
    if (is_float_grid(g) && g.uniform && g.grid_class == "level set") check_level_set(path, g, run, findings);
}

void check_vdb(const std::string& path, const RunContext& run, Findings& findings) {
    const std::vector<VdbGridInfo> grids = list_vdb(path);
    if (grids.empty()) findings.problem("the file holds no grid");
    std::set<std::string> names;
    for (const VdbGridInfo& g : grids) {
        if (!names.insert(g.name).second) findings.problem("two grids are called '" + g.name + "'");
        check_grid(path, g, run, findings);
    }
}

/// Whether ImageJ would show the voxels of an image: it shows labels as black if the file states no display range.
bool has_display_range(const std::string& path, const FileFacts& facts, double maximum) {
    constexpr double kLabels = 32;  // an image with a larger maximum contains grey values, not labels
    return facts.format != "ImageJ TIFF" || maximum > kLabels || header_holds(path, "\nmax=");
}

void check_image(const std::string& path, const ImageFlags& flags, const RunContext& run, Findings& findings) {
    const Image image = flags.read(path, run);
    const ImageGeometry& g = image.geometry();
    const auto range = image.range();
    FileFacts& facts = findings.facts;
    facts.unit = g.unit;
    facts.has_spacing = g.spacing_known;
    facts.is_rotated = !g.is_axis_aligned();
    const ImageInfo info = read_image_info(path, flags.options, run);
    facts.format = info.format;
    facts.has_segments = header_holds(path, "Segment0_ID");
    facts.is_big_tiff = header_holds(path, std::string("II+\0", 4)) || header_holds(path, std::string("MM\0+", 4));
    facts.has_display_range = has_display_range(path, facts, range[1]);
    const std::optional<ChunkCount> chunks = image.chunks();
    const bool of_chunks = chunks && chunks->read < chunks->total;
    // Whether the range was found from a part of the voxels: some chunks, or some slices of a mapped file.
    const bool is_sample = of_chunks || (!chunks && info.bytes_to_hold == 0);
    if (of_chunks)
        findings.remark(std::to_string(chunks->read) + " of " + std::to_string(chunks->total) +
                        " chunks were read: problems of the others are found only when these are read");
    if (range[0] == range[1] && !is_sample)
        findings.problem("all voxels are " + to_text(range[0]) + ": there is no edge");
    if (g.unit.empty()) findings.remark("the file states no unit of length: lengths are in its own units");
    const auto [minimum, maximum] = std::minmax_element(g.spacing.begin(), g.spacing.end());
    if (*maximum > kFlatVoxels * *minimum)
        findings.remark("voxels are " + to_text(*maximum / *minimum) +
                        " times longer along one axis: between the slices the surface is interpolated");
    if (!g.spacing_known)
        findings.remark("the file states no complete spacing: 1 is used for missing values; see --spacing");
    else if (g.spacing == Vec3{1, 1, 1})
        findings.remark("spacing is 1, 1, 1: this may be a placeholder; see --spacing");
    if (!g.is_axis_aligned())
        findings.remark("the image is rotated: NRRD, NIfTI and MetaImage can store that, TIFF cannot");
}

void check_mesh_file(const std::string& path, const RunContext& run, Findings& findings) {
    const TriangleMesh mesh = read_mesh(path);
    const std::string unit = word_in_header(path, "covol_unit");
    if (unit != "not") findings.facts.unit = unit;  // "not" is the first word of "not stated"
    check_measures(mesh, "the mesh", findings);
    // In formats that hold several meshes, each mesh is a separate solid: crossings between two of them are not
    // self-intersections.
    const Crossings crossings = count_crossings(mesh);
    const bool apart = holds_several_meshes(path);
    const int own = crossings.within + (apart ? 0 : crossings.between);
    findings.facts.crossings = own;
    if (findings.program() == Program::Print) findings.facts.wall = measure_wall(mesh, run);
    if (own > 0 && findings.program() != Program::Print)
        findings.problem("the mesh has " + std::to_string(own) + " self-intersections");
    if (apart && crossings.between > 0)
        findings.remark("triangles of different pieces intersect " + std::to_string(crossings.between) +
                        " times: the solids touch or overlap; join them by a Boolean union if one solid is needed");
    std::vector<Vec3> corners;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) corners.push_back(mesh.place(v));
    const WorldBox box = bounding_box(corners);
    double extent = 0;
    for (int a = 0; a < 3; ++a) extent = std::max(extent, box.max[a] - box.min[a]);
    check_extent(extent, "the mesh", findings);
}

void check_points(const std::string& path, const std::string& image_path, const ImageFlags& flags,
                  const RunContext& run, Findings& findings) {
    const PointCloud cloud = read_points(path);
    const std::vector<Vec3> distinct = merge_close_points(cloud.points, 0);
    if (distinct.size() < cloud.points.size())
        findings.remark(std::to_string(cloud.points.size() - distinct.size()) + " points are exact duplicates");
    if (distinct.size() < 4) {
        findings.problem(std::to_string(distinct.size()) + " distinct points enclose no volume");
    } else {
        const std::vector<IsolatedPoint> isolated = find_isolated_points(distinct);
        for (const auto& [index, distance] : isolated) {
            const auto& [x, y, z] = distinct[index];
            findings.remark("the point " + to_text(x) + " " + to_text(y) + " " + to_text(z) +
                            " lies apart from all others, " + to_text(distance) + " away: it may be a mistake");
        }
        const SpacingStatistics s = measure_spacing(distinct);
        if (isolated.empty() && s.max > kFarPoint * s.median)
            findings.remark("a point lies " + to_text(s.max) +
                            " from its nearest neighbour, and the median of this distance is " + to_text(s.median) +
                            ": it may be an outlier");
    }
    if (image_path.empty()) return;
    const ImageGeometry geometry = read_image_geometry(image_path, flags.options, run);
    try {
        check_inside(cloud, geometry, run);
    } catch (const Error& error) {
        findings.problem(with_flags(error.what()));
    }
}

void check(const std::string& path, Program program, const std::string& image_path, const ImageFlags& flags,
           Session& session) {
    Findings findings(session, program);
    const FileKind kind = kind_of_file(path);
    findings.facts.kind = kind;
    findings.facts.ending = long_ending(split_grid_name(path).path);
    session.report()["kind"] = to_string(kind);
    switch (kind) {
        case FileKind::Vdb: check_vdb(path, session.run(), findings); break;
        case FileKind::Image: check_image(path, flags, session.run(), findings); break;
        case FileKind::Mesh: check_mesh_file(path, session.run(), findings); break;
        case FileKind::Points: check_points(path, image_path, flags, session.run(), findings); break;
    }
    for (const Advice& advice : advice_for(program, findings.facts)) findings.advise(advice);
    session.report()["problems"] = findings.problems();
    session.print(path + ": " +
                  (findings.problems() == 0 ? "no problem" : std::to_string(findings.problems()) + " problem(s)"));
    if (findings.problems() > 0) session.set_exit_code(kBadInput);
}

}  // namespace

void add_check(Session& session) {
    const auto path = std::make_shared<std::string>();
    const auto image = std::make_shared<std::string>();
    const auto flags = std::make_shared<ImageFlags>();
    const auto program = std::make_shared<Program>(Program::Any);
    CLI::App* command =
        session.add_command("check", "Report the problems that a file would cause in Blender, Houdini, Slicer or covol",
                            [=, &session] { check(*path, *program, *image, *flags, session); });
    in_group(*command, Group::Input);
    command->add_option("file", *path, ".vdb, image, mesh or points; exit code 3 if there is a problem")
        ->required()
        ->type_name("FILE");
    add_words(*command, {"for", {}, {}, "report problems in this program or in 3D printing, and how to solve them"},
              {"", "blender", "houdini", "slicer", "fiji", "print"},
              [program](std::size_t n) { *program = Program(n); })
        ->default_str("no program in particular");
    command->add_option("--image", *image, "for points: the image to which they belong")->type_name("IMAGE");
    flags->bind(*command);
}

}  // namespace covol::tool
