#include "segment/doubts.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>

#include "base/heuristics.h"
#include "covol/error.h"
#include "covol/points.h"
#include "grid/levels_at.h"
#include "inference/heuristics.h"
#include "points/kd_tree.h"
#include "segment/heuristics.h"

namespace covol::pipeline {
namespace {

/// Positions distributed over the outermost voxels of the image, world units.
std::vector<Vec3> places_on_border(const ImageGeometry& geometry) {
    constexpr int kPlaces = 24;  // along each edge
    std::vector<Vec3> places;
    for (int axis = 0; axis < 3; ++axis)
        for (const bool upper : {false, true})
            for (int i = 0; i < kPlaces; ++i)
                for (int j = 0; j < kPlaces; ++j) {
                    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
                    Vec3 index;
                    index[axis] = upper ? geometry.size[axis] - 1 : 0;
                    index[u] = (i + 0.5) / kPlaces * geometry.size[u] - 0.5;
                    index[v] = (j + 0.5) / kPlaces * geometry.size[v] - 0.5;
                    places.push_back(geometry.index_to_world(index));
                }
    return places;
}

std::vector<char> are_inside(const FloatGrid& u, const std::vector<Vec3>& places) {
    std::vector<char> inside;
    const auto accessor = u.getConstAccessor();
    for (const Vec3& p : places)
        inside.push_back(accessor.getValue(openvdb::Coord::round(u.worldToIndex(openvdb::Vec3d(p[0], p[1], p[2])))) <
                         0);
    return inside;
}

}  // namespace

std::string place_of(const Image* image, const Vec3& mark) {
    if (image == nullptr) return "at " + detail::to_text(mark);
    const Vec3 index = image->geometry().world_to_index(mark);
    return "on slice " + std::to_string(std::lround(index[2])) + ", at voxel " + detail::to_text(index);
}

std::vector<char> inside_on_border(const Problem& problem, const FloatGrid& u) {
    if (problem.image == nullptr) return {};
    return are_inside(u, places_on_border(problem.image->geometry()));
}

void require_outside(const Problem& problem, const FloatGrid& u, const std::vector<char>& in_start) {
    if (problem.image == nullptr || problem.options.roi) return;
    const std::vector<Vec3> places = places_on_border(problem.image->geometry());
    const std::vector<char> inside = are_inside(u, places);
    if (2 * std::count(inside.begin(), inside.end(), 1) <= std::ptrdiff_t(places.size())) return;
    std::vector<Vec3> known = problem.given;
    known.insert(known.end(), problem.options.inside.begin(), problem.options.inside.end());
    const double far = far_from_marks(known.empty() ? places : known);
    const detail::KdTree tree(known);
    std::size_t unexpected = 0;
    for (std::size_t n = 0; n < places.size(); ++n) {
        if (!inside[n] || (!in_start.empty() && in_start[n])) continue;
        unexpected += tree.nearest(places[n]) > far * far;
    }
    if (2 * unexpected <= places.size()) return;
    throw Error(Errc::InvalidInput,
                "segment: the surface is inside out: " +
                    number(std::round(100.0 * double(unexpected) / double(places.size()))) +
                    " % of the image's border would be inside, far from all marks and seeds; mark more of the "
                    "body, or give positions outside of it (`outside`)");
}

Remarks doubt_isolated_marks(const Problem& problem) {
    Remarks remarks;
    const std::vector<IsolatedPoint> isolated = find_isolated_points(problem.given);
    if (isolated.empty()) return remarks;
    constexpr std::size_t kMaxReported = 3;
    std::string places;
    for (std::size_t n = 0; n < std::min(isolated.size(), kMaxReported); ++n)
        places += (n == 0 ? "" : "; ") + place_of(problem.image, problem.given[isolated[n].index]) + ", " +
                  number(isolated[n].distance) + " away";
    if (isolated.size() > kMaxReported) places += "; ...";
    remarks.warn(std::to_string(isolated.size()) + " of " + std::to_string(problem.given.size()) +
                     " marks lie far from all others (" + places +
                     "): the surface extends to them; check whether they are mistakes" +
                     (problem.options.contours ? "" : " (`remove_outliers` leaves them out)") +
                     ", or add marks near them",
                 problem.run);
    return remarks;
}

double far_from_marks(const std::vector<Vec3>& marks) {
    const WorldBox box = bounding_box(marks);
    return 0.5 * std::hypot(box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2]);
}

double largest_error_of_marks(const Problem& problem, double h, double noise) {
    double edge = h;
    if (problem.image != nullptr)
        for (const double s : problem.image->geometry().spacing) edge = std::max(edge, s);
    return std::max(kInference.off_cells * edge, kCommon.errors * noise);
}

bool misses_marks(const Problem& problem, const StartFacts& start, const FloatGrid& u) {
    const double beyond = std::min(largest_error_of_marks(problem, start.domain.voxel_size, start.cloud.noise),
                                   0.9 * double(u.background()));
    // A region of interest can exclude marks. They lie beyond the domain, where u is not known.
    std::vector<Vec3> marks = start.marks.trusted;
    std::erase_if(marks, [&](const Vec3& mark) { return !start.domain.contains(mark); });
    const std::vector<double> levels = detail::levels_at(u, marks);
    const auto far =
        std::count_if(levels.begin(), levels.end(), [&](double level) { return std::abs(level) > beyond; });
    return double(far) > kCommon.minority * double(marks.size());
}

}  // namespace covol::pipeline
