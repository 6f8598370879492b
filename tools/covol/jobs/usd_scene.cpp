#include "jobs/usd_scene.h"

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "covol/safe_text.h"
#include "covol/structures.h"
#include "jobs/length_unit.h"

namespace covol::tool {
namespace {

namespace fs = std::filesystem;

/// Frame rate of the animation. Each frame of the image is one frame of the animation.
constexpr int kFramesPerSecond = 24;

/// The path of a file relative to `folder` as an asset path: @@@...@@@, in which a single @ needs no escape.
std::string asset(const std::string& file, const fs::path& folder) {
    const fs::path near = fs::absolute(file).lexically_normal().lexically_relative(folder);
    const std::string name = near.empty() ? fs::absolute(file).string() : near.generic_string();
    return "@@@" + std::string(name.starts_with("..") || name.starts_with("/") ? "" : "./") + name + "@@@";
}

/// The text for use in a quoted string of USD: quotes and backslashes are replaced by '_'.
std::string in_quotes(const std::string& text) {
    std::string safe = safe_text(text);
    std::replace_if(
        safe.begin(), safe.end(), [](char c) { return c == '"' || c == '\\'; }, '_');
    return safe;
}

/// A valid name of a prim: invalid characters become '_'.
std::string identifier(const std::string& text) {
    std::string name = text;
    std::replace_if(
        name.begin(), name.end(), [](unsigned char c) { return c >= 128 || (std::isalnum(c) == 0 && c != '_'); }, '_');
    return name.empty() || std::isdigit(static_cast<unsigned char>(name.front())) != 0 ? "_" + name : name;
}

}  // namespace

void add_to_scene(UsdScene& scene, const SegmentJob& job, const StructuresOutput& output, const NameTag& tagged) {
    if (job.scene_path.empty()) return;
    scene.is_timelapse = tagged.frame.has_value();
    const auto add = [&](const std::string& grid, bool is_fog, const std::string& path) {
        if (path.empty()) return;
        UsdField& field = scene.fields[grid];
        field.is_fog = is_fog;
        field.files[tagged.frame.value_or(0)] = tagged(path);
    };
    for (const StructureOutput& s : output.structures) {
        add(s.grid, false, job.output);
        add(density_name(output, s), true, job.density_path);
    }
}

std::string to_usda(const UsdScene& scene, const std::string& path, const std::string& unit) {
    const fs::path whole = fs::absolute(path).lexically_normal();
    const std::string volume = identifier(whole.stem().string());
    std::ostringstream text;
    text.precision(9);
    text << "#usda 1.0\n(\n    defaultPrim = \"" << volume << "\"\n    metersPerUnit = " << metres_in(unit).value_or(1)
         << "\n    upAxis = \"Z\"\n";
    if (scene.is_timelapse) {
        int first = scene.fields.begin()->second.files.begin()->first, last = first;
        for (const auto& [grid, field] : scene.fields) {
            first = std::min(first, field.files.begin()->first);
            last = std::max(last, field.files.rbegin()->first);
        }
        text << "    startTimeCode = " << first << "\n    endTimeCode = " << last
             << "\n    timeCodesPerSecond = " << kFramesPerSecond << "\n    framesPerSecond = " << kFramesPerSecond
             << "\n";
    }
    text << "    customLayerData = {\n        string covol_unit = \"" << (unit.empty() ? "not stated" : in_quotes(unit))
         << "\"\n    }\n)\n\ndef Volume \"" << volume << "\"\n{\n";
    for (const auto& [grid, field] : scene.fields)
        text << "    rel field:" << identifier(grid) << " = </" << volume << "/" << identifier(grid) << ">\n";
    for (const auto& [grid, field] : scene.fields) {
        text << "\n    def OpenVDBAsset \"" << identifier(grid) << "\"\n    {\n        token fieldName = \"" << grid
             << "\"\n        token fieldDataType = \"float\"\n        token fieldClass = \""
             << (field.is_fog ? "fogVolume" : "levelSet") << "\"\n        asset filePath";
        if (scene.is_timelapse) {
            text << ".timeSamples = {\n";
            for (const auto& [frame, file] : field.files)
                text << "            " << frame << ": " << asset(file, whole.parent_path()) << ",\n";
            text << "        }\n";
        } else {
            text << " = " << asset(field.files.begin()->second, whole.parent_path()) << "\n";
        }
        text << "    }\n";
    }
    text << "}\n";
    return text.str();
}

void check_scene(const SegmentJob& job, Outputs& outputs) {
    if (job.scene_path.empty()) return;
    if (job.output.empty() && job.density_path.empty())
        throw UsageError("--usda: expected -o OUT.vdb or --density OUT.vdb, which the scene refers to");
    outputs.check("--usda", job.scene_path, OutputKind::Scene);
}

void write_scene(const UsdScene& scene, const SegmentJob& job, Session& session) {
    if (job.scene_path.empty() || scene.fields.empty()) return;
    const std::map<std::string, std::string> facts = session.provenance().metadata();
    const auto unit = facts.find("covol_unit");
    // The text is made for the final path of the scene, not for the temporary one: references are relative to it.
    session.outputs().add(job.scene_path,
                          [text = to_usda(scene, job.scene_path, unit == facts.end() ? "" : unit->second),
                           &session](const std::string& path) { write_text(path, text, session.run()); });
}

}  // namespace covol::tool
