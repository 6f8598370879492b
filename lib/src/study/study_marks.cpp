// Converts a study's structures to the input of segment_structures().
#include <set>
#include <utility>

#include "covol/error.h"
#include "covol/safe_text.h"
#include "covol/study.h"

namespace covol {
namespace {

PointCloud stated_cloud(std::vector<Vec3> places) {
    PointCloud points;
    points.points = std::move(places);
    points.stated = true;
    return points;
}

void add_study_paint(Marks& marks, const StudyStructure& structure, const ImageGeometry& image) {
    const std::optional<Image> paint = paint_of(structure, image);
    if (!paint) return;
    PaintedImage painted = make_painted(*paint);
    painted.name = marks.name;
    painted.is_shared = false;  // each structure is solved separately
    const int label = painted.labels.front().label;
    marks.paint.push_back({std::make_shared<const PaintedImage>(std::move(painted)), label});
}

}  // namespace

Marks marks_of(const StudyStructure& structure, const StudySite& site) {
    Marks marks;
    marks.name = safe_text(structure.name);
    std::vector<Vec3> inside, outside;
    for (const StudyMark& mark : structure.marks) switch (mark.kind) {
            case MarkKind::Surface: marks.points.push_back(mark.world); break;
            case MarkKind::Inside: inside.push_back(mark.world); break;
            case MarkKind::Outside: outside.push_back(mark.world); break;
        }
    marks.count = marks.points.size();
    if (!inside.empty()) marks.inside.push_back(stated_cloud(std::move(inside)));
    if (!outside.empty()) marks.outside.push_back(stated_cloud(std::move(outside)));
    PointCloud lines = stated_cloud({});
    for (const StudyOutline& outline : structure.outlines) {
        const std::size_t begin = lines.points.size();
        lines.points.insert(lines.points.end(), outline.world.begin(), outline.world.end());
        lines.lines.push_back({begin, lines.points.size(), outline.closed, {}});
    }
    if (!lines.lines.empty()) add_contours(marks, std::move(lines), {});
    add_study_paint(marks, structure, site.image);
    if (structure.guess) {
        if (!site.read_guess)
            throw Error(Errc::InvalidInput,
                        "study: '" + marks.name + "' has a guess, but no function that reads it was given");
        marks.guess = [read = site.read_guess, guess = *structure.guess](const RunContext& run) {
            return read(guess, run);
        };
    }
    return marks;
}

std::vector<Marks> marks_of(const StudyState& state, const StudySite& site) {
    std::vector<Marks> all;
    std::set<int> labels;
    for (const auto& structure : state) {
        if (!structure->has_evidence()) continue;
        Marks& marks = all.emplace_back(marks_of(*structure, site));
        if (structure->guess && structure->guess->label > 0 && labels.insert(structure->guess->label).second)
            marks.label = structure->guess->label;
    }
    return all;
}

}  // namespace covol
