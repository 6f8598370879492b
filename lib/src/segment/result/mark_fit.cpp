#include "segment/result/mark_fit.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>

#include "base/heuristics.h"
#include "grid/levels_at.h"
#include "segment/doubts.h"
#include "segment/heuristics.h"

namespace covol::pipeline {

std::vector<std::string> compare_with_marks(SegmentReport& report, const FloatGrid& surface, const Image* image,
                                            const std::vector<Vec3>& marks, const std::vector<double>& distances) {
    std::vector<std::string> lines;
    const double beyond = report.marks_off.beyond;
    SegmentReport::MarksOff& found = report.marks_off = {};
    found.beyond = beyond;
    const std::vector<double> levels = detail::levels_at(surface, marks);
    double sum = 0, squares = 0;
    for (std::size_t n = 0; n < marks.size(); ++n) {
        found.count += distances[n] > beyond;
        const double d = std::copysign(distances[n], levels[n]);
        sum += d;
        squares += d * d;
        if (distances[n] <= found.farthest) continue;
        found.farthest = distances[n];
        found.farthest_world = found.farthest_index = marks[n];
    }
    if (image != nullptr) found.farthest_index = image->geometry().world_to_index(found.farthest_world);
    if (found.count > 0)
        lines.push_back(std::to_string(found.count) + " of " + std::to_string(marks.size()) + " marks lie more than " +
                        number(beyond) + " from the surface, the farthest " + number(found.farthest) + " " +
                        place_of(image, found.farthest_world) +
                        ": check whether that mark is wrong, or add marks near it");
    const auto count = double(marks.size());
    const double h = surface.voxelSize()[0], bias = sum / count;
    const double error = std::sqrt(std::max(0.0, squares / count - bias * bias) / count);
    report.fit.bias = bias;
    if (std::abs(bias) >= kAutomatic.noticeable_voxels * std::max(h, report.cloud.noise) &&
        std::abs(bias) >= kCommon.errors * error)
        lines.push_back("on average the marks lie " + number(std::abs(bias) / h) + " voxels " +
                        (bias > 0 ? "outside" : "inside") + " the surface: it is too " +
                        (bias > 0 ? "small" : "large"));
    return lines;
}

}  // namespace covol::pipeline
