#include "flags/evidence_flags.h"

#include <iomanip>
#include <sstream>

#include "cli/output/report.h"
#include "cli/output/table.h"
#include "covol/error.h"
#include "covol/segment_structures.h"

namespace covol::tool {
namespace {

std::string text_of(const Vec3& v, int decimals) {
    std::ostringstream text;
    text << std::fixed << std::setprecision(decimals) << v[0] << "," << v[1] << "," << v[2];
    return text.str();
}

}  // namespace

void EvidenceFlags::bind(CLI::App& command) {
    in_group(command, Group::Output);
    command
        .add_option("--evidence", path,
                    "table of the slices: distances between surface and marks, and the area that neither marks nor "
                    "edges support")
        ->type_name("OUT.csv");
    command
        .add_option("--suggest", suggestions,
                    "suggest the N slices in which new marks would help most, and a position in each")
        ->type_name("N");
    command
        .add_option("--suggestions", marks_path,
                    "the suggested positions (3, or the number given by --suggest), for the program in which you set "
                    "marks: napari, 3D Slicer, Fiji")
        ->type_name("OUT.csv|.mrk.json|.roi");
}

void EvidenceFlags::check(Outputs& outputs, const std::function<std::string(const std::string&)>& tagged) const {
    outputs.check("--evidence", tagged(path), OutputKind::Table);
    outputs.check("--suggestions", tagged(marks_path), OutputKind::ProgramMarks);
    if (suggestions.value_or(0) < 0)
        throw Error(Errc::InvalidOptions, "--suggest: expected >= 0, got " + std::to_string(*suggestions));
}

Evidence EvidenceFlags::judge(const SegmentResult& result, const std::vector<Vec3>& marks, const Image& image,
                              const RunContext& run) const {
    return assess_evidence(result, marks, image,
                           suggestions.value_or(for_page || !marks_path.empty() ? kPageSuggestions : 0), run);
}

Json to_json(const Evidence& e) {
    Json slices = Json::array(), suggestions = Json::array();
    for (const SliceEvidence& s : e.slices)
        slices.push_back({{"slice", s.slice},
                          {"area", s.area},
                          {"unsupported_area", s.unsupported_area},
                          {"surface_to_marks", {{"mean", s.to_marks_mean}, {"max", s.to_marks_max}}},
                          {"edge_strength", s.edge_strength},
                          {"marks", s.marks},
                          {"marks_to_surface", {{"mean", s.marks_mean}, {"max", s.marks_max}}}});
    for (const Suggestion& s : e.suggestions)
        suggestions.push_back(
            {{"slice", s.slice}, {"area", s.area}, {"index", to_json(s.index)}, {"world", to_json(s.world)}});
    return {{"reach", e.reach},
            {"weak_edge", e.weak_edge},
            {"area", e.area},
            {"unsupported_area", e.unsupported_area},
            {"suggestions", suggestions},
            {"slices", slices}};
}

std::vector<VertexAttribute> vertex_attributes(const std::optional<Evidence>& evidence) {
    std::vector<VertexAttribute> attributes;
    if (!evidence) return attributes;
    if (!evidence->distance_to_marks.empty()) attributes.push_back({"distance_to_marks", evidence->distance_to_marks});
    if (!evidence->edge_strength.empty()) attributes.push_back({"edge_strength", evidence->edge_strength});
    return attributes;
}

void print_evidence(Session& session, const Evidence& e, const std::string& who) {
    std::ostringstream text;
    text << who << std::setprecision(3) << 100 * e.unsupported_area / e.area
         << " % of the surface rests on neither marks nor edges (farther than " << e.reach
         << " from marks, edge strength below " << e.weak_edge << ")";
    session.note(text.str());
    for (const Suggestion& s : e.suggestions) {
        text.str("");
        text << who << "marks would help in slice " << s.slice << ", at voxel " << text_of(s.index, 1) << " (world "
             << text_of(s.world, 3) << "): they would support an area of " << s.area;
        session.print(text.str());
    }
}

std::vector<NamedMark> suggested_marks(const std::vector<EvidenceOf>& surfaces) {
    std::vector<NamedMark> marks;
    for (const auto& [structure, evidence] : surfaces)
        for (const Suggestion& s : evidence->suggestions)
            marks.push_back({s.index, structure + ", slice " + std::to_string(s.slice)});
    return marks;
}

std::string evidence_csv(const std::vector<EvidenceOf>& surfaces) {
    Table table({"structure", "slice", "area", "unsupported_area", "unsupported_share", "surface_to_marks_mean",
                 "surface_to_marks_max", "edge_strength", "marks", "marks_to_surface_mean", "marks_to_surface_max"});
    for (const auto& [structure, evidence] : surfaces)
        for (const SliceEvidence& s : evidence->slices)
            table.row() << structure << s.slice << s.area << s.unsupported_area
                        << (s.area > 0 ? s.unsupported_area / s.area : 0.0) << s.to_marks_mean << s.to_marks_max
                        << s.edge_strength << s.marks << s.marks_mean << s.marks_max;
    return table.text();
}

}  // namespace covol::tool
