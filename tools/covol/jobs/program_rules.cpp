#include "jobs/program_rules.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <string_view>

#include "covol/file_set.h"
#include "jobs/length_unit.h"

namespace covol::tool {
namespace {

constexpr double kNozzle = 0.4;    // mm, common diameter of printer nozzles: thinner walls are not printed
constexpr double kPrintBed = 300;  // mm; wider objects get a remark on their size
constexpr double kSmallPart = 1;   // mm; narrower objects get a remark on their size

std::string number(double value) {
    std::ostringstream text;
    text.precision(4);
    text << value;
    return text.str();
}

/// Millimetres in one unit of the file; 0 if the unit is not known.
double millimetres(const FileFacts& f) { return f.unit == "mm" ? 1 : 1000 * metres_in(f.unit).value_or(0); }

bool ends_in(const FileFacts& f, std::initializer_list<std::string_view> endings) {
    return std::find(endings.begin(), endings.end(), f.ending) != endings.end();
}

bool is_vdb(const FileFacts& f) { return f.kind == FileKind::Vdb; }
bool is_mesh(const FileFacts& f) { return f.kind == FileKind::Mesh; }
bool is_image(const FileFacts& f) { return f.kind == FileKind::Image; }
bool is_tiff(const FileFacts& f) { return ends_in(f, {".tif", ".tiff", ".ome.tif", ".ome.tiff", ".btf", ".tf8"}); }
bool is_other_unit(const FileFacts& f) { return millimetres(f) > 0 && millimetres(f) != 1; }

std::string wide(const FileFacts& f) {
    return "it is " + number(f.extent) + " units wide, and a unit is a metre there";
}
std::string other_unit(const FileFacts& f) {
    return "its coordinates are in " + f.unit + ", which are interpreted as mm";
}

using Facts = const FileFacts&;
using Text = std::string;

struct Rule {
    Program program;
    bool is_problem;
    bool (*applies)(const FileFacts&);
    std::string (*text)(const FileFacts&);
    std::string (*remedy)(const FileFacts&);
};

constexpr bool kProblem = true, kRemark = false;

// One row for each problem: program, whether it fails the check, condition, effect, remedy. The rules for Blender were
// tested with Blender 3.4 of Debian (tests/cli/blender_test.py); the others follow from what is known about how the
// programs read files, and were not tested.
const std::vector<Rule>& rules() {
    static const std::vector<Rule> table{
        {Program::Blender, kProblem, [](Facts f) { return is_vdb(f) && f.has_level_set && !f.has_density; },
         [](Facts) -> Text { return "a level set is not drawn: the shader of volumes reads the grid 'density'"; },
         [](Facts) -> Text { return "--density with the name of -o puts both into one file"; }},
        {Program::Blender, kRemark, [](Facts f) { return is_vdb(f) && f.has_level_set; },
         [](Facts f) -> Text {
             return "the modifier Volume to Mesh moves the surface by half a voxel along each axis, " +
                    number(f.voxel_size / 2);
         },
         [](Facts) -> Text { return "import the mesh (--mesh OUT.ply), or move the object back"; }},
        {Program::Blender, kRemark, [](Facts f) { return is_vdb(f) && f.has_blosc; },
         [](Facts) -> Text { return "it is compressed with Blosc: builds without Blosc cannot open the file"; },
         [](Facts) -> Text { return "--compression none, or covol convert IN.vdb OUT.vdb --compression none"; }},
        {Program::Blender, kRemark, [](Facts f) { return is_vdb(f) && f.extent > kFarClip; }, wide,
         [](Facts f) -> Text {
             return "scale the object by " + number(1 / f.extent) + ", or increase Clip End of the view";
         }},
        {Program::Blender, kRemark, [](Facts f) { return is_mesh(f) && f.extent > kFarClip; },
         [](Facts f) -> Text { return wide(f) + ": the view clips it"; },
         [](Facts f) -> Text { return "--unit-scale " + number(1 / f.extent); }},
        {Program::Blender, kRemark,
         [](Facts f) { return (is_mesh(f) || is_vdb(f)) && f.extent > 0 && f.extent < kNearClip; },
         [](Facts f) -> Text { return wide(f) + ": a dot"; },
         [](Facts f) -> Text {
             return is_mesh(f) ? "--unit-scale " + number(1 / f.extent) : "scale the object by " + number(1 / f.extent);
         }},
        {Program::Blender, kRemark,
         [](Facts f) {
             return is_mesh(f) && ends_in(f, {".ply", ".stl"});
         },
         [](Facts) -> Text { return "its importer drops normals: triangles are flat"; },
         [](Facts) -> Text { return "Object > Shade Smooth, or --mesh OUT.glb"; }},
        {Program::Blender, kRemark, [](Facts f) { return f.ending == ".glb"; },
         [](Facts) -> Text { return "the importer of Blender 3.4 fails with numpy 1.24 and later, as in Debian 12"; },
         [](Facts) -> Text { return "'import numpy; numpy.bool = bool' in its console first, or --mesh OUT.ply"; }},
        {Program::Blender, kProblem, [](Facts f) { return f.ending == ".off"; },
         [](Facts) -> Text { return "it has no importer of .off"; },
         [](Facts) -> Text { return "covol convert IN.off OUT.glb"; }},
        {Program::Blender, kProblem, is_image,
         [](Facts) -> Text { return "it cannot open an image stack as a volume"; },
         [](Facts) -> Text { return "covol convert IMAGE OUT.vdb"; }},

        {Program::Houdini, kRemark, [](Facts f) { return is_vdb(f) && f.has_blosc; },
         [](Facts) -> Text {
             return "it is compressed with Blosc: a host whose Blosc differs from that of its OpenVDB may crash";
         },
         [](Facts) -> Text { return "--compression none, or covol convert IN.vdb OUT.vdb --compression none"; }},
        {Program::Houdini, kRemark, is_vdb,
         [](Facts) -> Text { return "y is up there and z here: the volume lies on its back"; },
         [](Facts) -> Text { return "turn it by -90 degrees about x"; }},
        {Program::Houdini, kRemark, [](Facts f) { return is_mesh(f) && f.ending != ".glb"; },
         [](Facts) -> Text { return "y is up there: a mesh that was written z up lies on its back"; },
         [](Facts) -> Text { return "--up y"; }},
        {Program::Houdini, kRemark, [](Facts f) { return (is_vdb(f) || is_mesh(f)) && f.extent > kFarClip; }, wide,
         [](Facts f) -> Text {
             return is_mesh(f) ? "--unit-scale " + number(1 / f.extent) : "scale it by " + number(1 / f.extent);
         }},
        {Program::Houdini, kProblem, is_image,
         [](Facts) -> Text { return "it cannot open an image stack as a volume"; },
         [](Facts) -> Text { return "covol convert IMAGE OUT.vdb"; }},

        {Program::Slicer, kProblem, is_vdb, [](Facts) -> Text { return "it does not open .vdb"; },
         [](Facts) -> Text { return "covol mask IN.vdb --like IMAGE -o OUT.seg.nrrd, or --mesh OUT.ply"; }},
        {Program::Slicer, kProblem,
         [](Facts f) {
             return is_mesh(f) && ends_in(f, {".off", ".glb"});
         },
         [](Facts f) -> Text { return "it does not open " + f.ending + " as a model"; },
         [](Facts) -> Text { return "--mesh OUT.ply, .obj or .stl"; }},
        {Program::Slicer, kProblem, [](Facts f) { return is_mesh(f) && is_other_unit(f); }, other_unit,
         [](Facts f) -> Text { return "--unit-scale " + number(millimetres(f)) + ", and the image in mm as well"; }},
        {Program::Slicer, kRemark, is_mesh,
         [](Facts) -> Text {
             return "models are LPS since version 4.11; older ones interpret them as RAS, rotated by 180 degrees";
         },
         [](Facts) -> Text { return "choose LPS in the dialog Add Data, or harden a transform of -1, -1, 1"; }},
        {Program::Slicer, kRemark, [](Facts f) { return is_image(f) && is_other_unit(f); },
         [](Facts f) -> Text { return "lengths are in " + f.unit + ", and shown as mm"; },
         [](Facts) -> Text { return "read its numbers as that unit, or --spacing in mm"; }},
        {Program::Slicer, kProblem, [](Facts f) { return f.ending == ".seg.nrrd" && !f.has_segments; },
         [](Facts) -> Text {
             return "Segment0_ID and the other fields are missing: the segments have no names and colours";
         },
         [](Facts) -> Text { return "covol mask IN.vdb --like IMAGE -o OUT.seg.nrrd"; }},
        {Program::Slicer, kProblem, is_tiff,
         [](Facts) -> Text { return "it reads neither spacing nor origin of TIFF: slices are 1 mm apart"; },
         [](Facts) -> Text { return "write .nrrd, .nii.gz or .seg.nrrd"; }},
        {Program::Slicer, kProblem,
         [](Facts f) {
             return ends_in(f, {".npy", ".zarr", ".ome.zarr", ".h5", ".hdf5", ".ims", ".ics"});
         },
         [](Facts f) -> Text { return "it does not open " + f.ending; },
         [](Facts) -> Text { return "write .nrrd or .nii.gz"; }},
        {Program::Slicer, kProblem, [](Facts f) { return is_image(f) && !f.has_spacing; },
         [](Facts) -> Text { return "without spacing voxels are cubes of 1 mm"; },
         [](Facts) -> Text { return "--spacing SX,SY,SZ when it is read, and write .nrrd"; }},

        {Program::Fiji, kProblem, is_vdb, [](Facts) -> Text { return "it does not open .vdb"; },
         [](Facts) -> Text { return "covol mask IN.vdb --like IMAGE -o OUT.tif, or covol convert IN.vdb OUT.tif"; }},
        {Program::Fiji, kProblem,
         [](Facts f) {
             return is_mesh(f) && ends_in(f, {".ply", ".off", ".glb"});
         },
         [](Facts f) -> Text { return "its 3D viewer does not open " + f.ending; },
         [](Facts) -> Text { return "--mesh OUT.obj or .stl"; }},
        {Program::Fiji, kProblem, [](Facts f) { return is_tiff(f) && !f.has_display_range; },
         [](Facts) -> Text { return "labels without min and max are shown on the whole range of the type: black"; },
         [](Facts) -> Text { return "Image > Adjust > Brightness/Contrast > Auto, or write it by covol mask"; }},
        {Program::Fiji, kRemark, [](Facts f) { return f.is_big_tiff; },
         [](Facts) -> Text { return "BigTIFF cannot be opened by drag and drop"; },
         [](Facts) -> Text { return "File > Import > Bio-Formats"; }},
        {Program::Fiji, kRemark,
         [](Facts f) {
             return ends_in(f, {".ome.tif", ".ome.tiff"});
         },
         [](Facts) -> Text { return "its own TIFF reader ignores OME's unit and spacing"; },
         [](Facts) -> Text { return "File > Import > Bio-Formats, or write .tif"; }},
        {Program::Fiji, kRemark, [](Facts f) { return is_image(f) && f.unit.empty(); },
         [](Facts) -> Text { return "no unit is stated: lengths are in pixels"; },
         [](Facts) -> Text { return "Image > Properties"; }},
        {Program::Fiji, kRemark, [](Facts f) { return is_image(f) && f.is_rotated; },
         [](Facts) -> Text { return "the rotation of the image is lost there: points come back in voxels"; },
         [](Facts) -> Text { return "--points-space index"; }},
        {Program::Fiji, kProblem,
         [](Facts f) {
             return ends_in(f, {".npy", ".zarr", ".ome.zarr"});
         },
         [](Facts f) -> Text { return "it does not open " + f.ending + " by itself"; },
         [](Facts) -> Text { return "covol mask -o OUT.tif; images by a plugin for their format"; }},

        {Program::Print, kProblem, [](Facts f) { return !is_mesh(f); },
         [](Facts) -> Text { return "slicers require meshes"; },
         [](Facts) -> Text { return "covol mesh IN.vdb -o OUT.stl"; }},
        {Program::Print, kProblem, [](Facts f) { return is_mesh(f) && !f.is_closed; },
         [](Facts) -> Text { return "it is open: a slicer does not know what is inside"; },
         [](Facts) -> Text { return "--repair, or --holes close if a cloud has holes"; }},
        {Program::Print, kProblem, [](Facts f) { return is_mesh(f) && f.crossings > 0; },
         [](Facts f) -> Text { return "triangles intersect each other " + std::to_string(f.crossings) + " times"; },
         [](Facts) -> Text { return "covol mesh --repair"; }},
        {Program::Print, kProblem, [](Facts f) { return is_mesh(f) && is_other_unit(f); }, other_unit,
         [](Facts f) -> Text { return "--unit-scale " + number(millimetres(f)) + ", times the desired enlargement"; }},
        {Program::Print, kRemark, [](Facts f) { return is_mesh(f) && millimetres(f) == 0; },
         [](Facts) -> Text { return "no unit is stated: lengths are interpreted as mm"; },
         [](Facts) -> Text { return "--unit-scale F converts them to mm"; }},
        {Program::Print, kRemark, [](Facts f) { return is_mesh(f) && (f.extent > kPrintBed || f.extent < kSmallPart); },
         [](Facts f) -> Text { return "it is " + number(f.extent) + " mm wide at its present size"; },
         [](Facts f) -> Text { return "--unit-scale " + number(100 / f.extent) + " makes it 100 mm"; }},
        {Program::Print, kRemark, [](Facts f) { return is_mesh(f) && f.wall >= 0 && f.wall < kNozzle; },
         [](Facts f) -> Text {
             return "its walls are " + number(f.wall) + " mm thin in places, a nozzle is " + number(kNozzle) +
                    " mm wide";
         },
         [](Facts) -> Text { return "covol mesh --isovalue makes a solid thicker, --unit-scale all of it larger"; }},
    };
    return table;
}

std::string header_of(const std::string& path) {
    constexpr std::size_t kHeader = 1 << 16;
    std::string text(kHeader, '\0');
    std::ifstream file = open_regular_file(path);
    file.read(text.data(), std::streamsize(text.size()));
    text.resize(std::size_t(std::max<std::streamsize>(file.gcount(), 0)));
    return text;
}

}  // namespace

std::vector<Advice> advice_for(Program program, const FileFacts& facts) {
    std::vector<Advice> found;
    for (const Rule& rule : rules())
        if (rule.program == program && rule.applies(facts))
            found.push_back({rule.is_problem, rule.text(facts), rule.remedy(facts)});
    return found;
}

std::string word_in_header(const std::string& path, const std::string& key) {
    const std::string text = header_of(path);
    const auto is_part = [](unsigned char c) { return std::isalnum(c) != 0; };
    std::size_t begin = text.find(key);
    if (begin == std::string::npos) return {};
    begin += key.size();
    while (begin < text.size() && !is_part(text[begin])) ++begin;
    std::size_t end = begin;
    while (end < text.size() && is_part(text[end])) ++end;
    return text.substr(begin, end - begin);
}

bool header_holds(const std::string& path, const std::string& text) {
    return header_of(path).find(text) != std::string::npos;
}

}  // namespace covol::tool
