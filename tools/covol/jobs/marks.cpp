#include "jobs/marks.h"

#include <algorithm>
#include <utility>

namespace covol::tool {
namespace {

void take(std::vector<Vec3>& list, const std::vector<std::uint32_t>& which) {
    if (list.empty()) return;
    std::vector<Vec3> taken(which.size());
    std::transform(which.begin(), which.end(), taken.begin(), [&](std::uint32_t n) { return list[n]; });
    list = std::move(taken);
}

}  // namespace

Marks read_marks(const PointFlags& points, const ContourFlags& contours, const CloudFlags& cloud,
                 const ImageGeometry* geometry, const RunContext& run) {
    Marks marks;
    WorldPoints read = read_world_points(points, geometry, run);
    Json& report = marks.report["points"] = {{"densified", 0}, {"paths", points.paths}, {"rules", read.rules}};
    std::size_t count = read.points.size();
    if (geometry == nullptr) {
        const std::vector<std::uint32_t> used = cloud.used(read.points, run, report);
        for (std::vector<Vec3>* list : {&read.points, &read.hints.normals, &read.hints.to_sensor}) take(*list, used);
    }
    marks.points = std::move(read.points);
    marks.hints = std::move(read.hints);
    marks.drawn = contours.read(points.options, geometry, run);
    marks.given = marks.points;
    for (const PointCloud& lines : marks.drawn) {
        const std::vector<Vec3> world = geometry != nullptr ? to_world(lines, *geometry) : to_world(lines);
        marks.given.insert(marks.given.end(), world.begin(), world.end());
        count += world.size();
    }
    report["count"] = count;
    return marks;
}

void prepare_marks(Marks& marks, const CloudFlags& cloud, const ContourFlags& contours, const ImageGeometry* geometry,
                   double h, Session& session, const RunContext& run) {
    std::vector<Vec3> cleaned = cloud.clean(marks.points, h, run, marks.report["points"]);
    if (cleaned != marks.points) marks.hints = carried(marks.hints, marks.points, cleaned);
    marks.points = std::move(cleaned);
    marks.given = marks.points;
    if (marks.drawn.empty()) return;
    const Stopwatch watch;
    marks.contours = contours.densify(marks.drawn, geometry, h, run, marks.report["contours"]);
    marks.given.insert(marks.given.end(), marks.contours->marks.begin(), marks.contours->marks.end());
    session.add_seconds("contours", watch.seconds());
}

}  // namespace covol::tool
