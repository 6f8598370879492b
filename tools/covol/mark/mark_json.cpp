#include "mark/mark_json.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "covol/study.h"

namespace covol::tool {

const char* stage_name(StudyResult::Stage stage) {
    switch (stage) {
        case StudyResult::Stage::Empty: return "empty";
        case StudyResult::Stage::Working: return "working";
        case StudyResult::Stage::First: return "first";
        case StudyResult::Stage::Refined: return "refined";
        case StudyResult::Stage::Failed: break;
    }
    return "failed";
}

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json result_json(const StudyResult& result, std::uint64_t version,
                 const std::optional<IntensityStatistics>& intensity) {
    Json json{{"structure", result.structure},     {"version", version},          {"seq", result.sequence},
              {"stage", stage_name(result.stage)}, {"progress", result.progress}, {"message", result.message},
              {"seconds", result.seconds}};
    if (!result.surface) return json;
    const SegmentReport& report = result.surface->report;
    Vec3 low{}, high{};
    for (std::size_t a = 0; a < 3; ++a) {
        const auto less = [a](const auto& p, const auto& q) { return p[a] < q[a]; };
        const auto& vertices = result.surface->mesh.vertices;
        if (vertices.empty()) break;
        const auto [first, last] = std::minmax_element(vertices.begin(), vertices.end(), less);
        low[a] = (*first)[a];
        high[a] = (*last)[a];
    }
    json["triangles"] = result.surface->mesh.triangles.size();
    json["volume"] = report.surface.volume;
    json["area"] = report.surface.area;
    json["extent"] = {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
    json["mean"] = json["sd"] = nullptr;
    if (intensity && intensity->voxels > 0) {
        json["mean"] = intensity->mean;
        json["sd"] = intensity->standard_deviation;
    }
    json["expected"] = nullptr;
    if (const auto& expected = report.inference.expected)
        json["expected"] = {{"value", expected->value}, {"low", expected->low}, {"high", expected->high}};
    json["warnings"] = report.warnings;
    return json;
}

Json options_json(const StudyOptions& options) {
    return Json::parse(covol::to_json(KeyedAction{"", StudyActions::SetOptions{options}})).at("options");
}

Json structure_json(const StudyStructure& structure, const Json& result) {
    Json marks = Json::array(), outlines = Json::array(), strokes = Json::array();
    for (const StudyMark& m : structure.marks)
        marks.push_back({{"id", m.id}, {"kind", kWords<MarkKind>[std::size_t(m.kind)]}, {"world", m.world}});
    for (const StudyOutline& o : structure.outlines)
        outlines.push_back({{"id", o.id}, {"axis", o.axis}, {"at", o.at}, {"closed", o.closed}, {"world", o.world}});
    for (const StudyStroke& s : structure.strokes) {
        Json stroke{{"id", s.id}, {"erases", s.erases}, {"radius", s.radius}, {"world", s.world}};
        if (s.axis) stroke.update({{"axis", *s.axis}, {"at", s.at}});
        strokes.push_back(std::move(stroke));
    }
    Json json{{"id", structure.id},
              {"name", structure.name},
              {"color", structure.color},
              {"locked", structure.locked},
              {"visible", structure.visible},
              {"marks", std::move(marks)},
              {"outlines", std::move(outlines)},
              {"strokes", std::move(strokes)},
              {"guess", nullptr},
              {"result", result}};
    if (structure.guess)  // its path is not sent to pages
        json["guess"] = {{"name", std::filesystem::path(structure.guess->path).filename().string()},
                         {"label", structure.guess->label}};
    return json;
}

}  // namespace covol::tool
