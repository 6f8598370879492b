#include "marks.h"

#include <utility>

namespace covol::tool {

Marks read_marks(const PointFlags& points, const ContourFlags& contours, const ImageGeometry* geometry, const RunContext& run) {
    Marks marks;
    WorldPoints cloud = read_world_points(points, geometry, run);
    marks.points = std::move(cloud.points);
    marks.hints = std::move(cloud.hints);
    marks.drawn = contours.read(points.options, geometry, run);
    marks.given = marks.points;
    for (const PointCloud& lines : marks.drawn) {
        const std::vector<Vec3> world = to_world(lines, geometry);
        marks.given.insert(marks.given.end(), world.begin(), world.end());
    }
    marks.report["points"] = {{"count", marks.given.size()}, {"densified", 0}, {"paths", points.paths}, {"rules", cloud.rules}};
    return marks;
}

void prepare(Marks& marks, const CloudFlags& cloud, const ContourFlags& contours, const ImageGeometry* geometry, double h,
             Session& session, const RunContext& run) {
    std::vector<Vec3> cleaned = cloud.clean(marks.points, h, run, marks.report["points"]);
    if (cleaned != marks.points) marks.hints = carried(marks.hints, marks.points, cleaned);
    marks.points = std::move(cleaned);
    marks.given = marks.points;
    if (marks.drawn.empty()) return;
    const Stopwatch watch;
    marks.contours = contours.densify(marks.drawn, geometry, h, run, marks.report["contours"]);
    marks.given.insert(marks.given.end(), marks.contours->marks.begin(), marks.contours->marks.end());
    session.add_seconds("contours", watch.seconds());
    session.add_seconds("total", watch.seconds());
}

}  // namespace covol::tool
