#include "mark/exports.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <utility>

#include "cli/output/report.h"
#include "cli/output/table.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "covol/image_stream.h"
#include "covol/mesh_io.h"
#include "covol/safe_text.h"
#include "covol/structures.h"
#include "covol/vdb_io.h"
#include "jobs/structure_outputs.h"
#include "mark/mark_json.h"

namespace covol::tool {
namespace {

/// A valid file name, made from the name of a structure.
std::string file_name(const std::string& name, const std::string& ending) {
    std::string safe;
    for (const char c : name) safe += (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-') ? c : '_';
    if (safe.empty() || safe.find_first_not_of('_') == std::string::npos) safe = "structure";
    return safe + ending;
}

Export made_of_file(const std::string& name, const std::string& scratch, const RunContext& run,
                    const std::function<void(const std::string& path)>& write) {
    const ScratchFolder folder(scratch, run);
    const std::filesystem::path path = folder.path() / name;
    write(path.string());
    std::ifstream file(path, std::ios::binary);
    Export made{name, {std::istreambuf_iterator<char>(file), {}}};
    if (!file) throw Error(Errc::Io, "the export cannot be read back");
    return made;
}

std::string marks_table(const StudyState& wanted) {
    Table table({"structure", "kind", "x", "y", "z"});
    for (const auto& structure : wanted)
        for (const StudyMark& mark : structure->marks) {
            Table& row = table.row() << structure->name << kWords<MarkKind>[std::size_t(mark.kind)];
            for (const double x : mark.world) row << text_of(Json(x));  // exact
        }
    return table.text();
}

}  // namespace

Export make_export(const std::string& format, const StudyState& wanted,
                   const std::function<StructuresResult()>& results,
                   const std::function<std::optional<IntensityStatistics>(const StructureResult&)>& intensity,
                   const Image& image, const std::string& scratch, const RunContext& run) {
    const std::string whole = wanted.size() == 1 ? wanted.front()->name : "structures";
    if (format == "marks.csv") return {file_name(whole, "_marks.csv"), marks_table(wanted)};
    static constexpr std::array kFormats{"mask.nii.gz", "mask.nrrd",   "mask.tif", "mesh.ply",
                                         "mesh.stl",    "surface.vdb", "table.csv"};
    if (std::find(kFormats.begin(), kFormats.end(), format) == kFormats.end())
        throw Error(Errc::InvalidInput, "'format': unknown value");
    StructuresResult all = results();
    const auto is_wanted = [&](const StructureResult& result) {
        return std::any_of(wanted.begin(), wanted.end(),
                           [&](const auto& structure) { return safe_text(structure->name) == result.name; });
    };
    std::erase_if(all.structures, [&](const StructureResult& result) { return !is_wanted(result); });
    if (all.structures.empty()) throw Error(Errc::InvalidInput, "the structure has no marks yet");
    const std::string ending = format.substr(format.find('.'));
    if (format == "table.csv") {
        Table table(result_columns(image.geometry().unit));
        for (const StructureResult& s : all.structures)
            add_result(table.row(), s.name, s.label, s.result, intensity(s), run);
        return {file_name(whole, ending), table.text()};
    }
    return made_of_file(file_name(whole, ending), scratch, run, [&](const std::string& path) {
        if (format.starts_with("mesh")) {
            if (all.structures.size() > 1)
                throw Error(Errc::InvalidInput, "choose one structure: a mesh file holds one");
            return write_mesh(path, all.structures.front().result.mesh);
        }
        if (format.starts_with("surface")) {
            std::vector<FloatGridPtr> grids;
            for (const StructureResult& s : all.structures) grids.push_back(s.result.surface);
            return write_vdb(path, grids);
        }
        std::vector<Structure> solids;
        std::vector<int> labels;
        for (const StructureResult& s : all.structures) {
            solids.push_back({s.name, s.result.surface});
            labels.push_back(s.label);
        }
        write_image(path, LabelImage(std::move(solids), image.geometry(), std::move(labels)), {true, image.path()},
                    run);
    });
}

}  // namespace covol::tool
