#include "segment/solve/vanished.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "base/heuristics.h"
#include "cloud/indicator/heuristics.h"
#include "covol/domain.h"
#include "covol/guess.h"
#include "covol/points.h"
#include "points/parts.h"

namespace covol::detail {
namespace {

/// Standard deviations of the positions along their principal axes, ascending.
Eigen::Vector3d extents(const std::vector<Vec3>& points) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Vec3& p : points) mean += Eigen::Vector3d(p[0], p[1], p[2]);
    mean /= double(std::max<std::size_t>(points.size(), 1));
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (const Vec3& p : points) {
        const Eigen::Vector3d v = Eigen::Vector3d(p[0], p[1], p[2]) - mean;
        squares += v * v.transpose();
    }
    squares /= double(std::max<std::size_t>(points.size(), 1));
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(squares).eigenvalues().cwiseMax(0.0).cwiseSqrt();
}

}  // namespace

std::string why_nothing_held(const std::vector<Vec3>& points, double tag_distance, bool encloses) {
    const Eigen::Vector3d extent = extents(points);
    const bool is_flat = extent[0] <= kCommon.negligible * extent[2],
               is_line = extent[1] <= kCommon.negligible * extent[2];
    std::ostringstream text;
    text.precision(3);
    if (encloses && !is_flat) {
        text << "the points are too sparse to hold the surface at the tag distance " << tag_distance
             << "; try `tag_distance = " << kCommon.growth * tag_distance << "`, a lower `delta`, or more points";
        return text.str();
    }
    if (is_flat) {
        // Small parts that are far apart nearly lie on a line or in a plane, too, although each may enclose a body.
        const double edge = 2 * kCloud.coarse * measure_spacing(points).median;
        const std::vector<Vec3> part = edge > 0 ? cloud::largest_part(points, 1 / kCommon.negligible, edge) : points;
        if (part.size() < points.size() && can_enclose(part)) {
            text << "the points form parts that are far apart compared to their size: the largest part is "
                 << longest_side(bounding_box(part)) << " long, all points together "
                 << longest_side(bounding_box(points)) << "; reconstruct each part alone, or try `init = cloud`";
            return text.str();
        }
    }
    const WorldBox box = bounding_box(points);
    Vec3 side;
    for (int a = 0; a < 3; ++a) side[a] = box.max[a] - box.min[a];
    const double radius = 0.5 * std::hypot(side[0], side[1], side[2]);  // of the ball around the points' box
    // Width of the widest gap to be expected, in units of the mean distance between nearest points: of n random points
    // on a surface, the expected number without another point within this distance is 1/n.
    const double gap = 2 * std::sqrt(2 * std::log(double(std::max<std::size_t>(points.size(), 2))) / std::numbers::pi);
    const double layer = std::min(gap * measure_spacing(points).mean, radius);
    text << (is_line   ? "the points lie on a line"
             : is_flat ? "the points lie in a plane"
                       : "the points enclose nothing")
         << " and keep no surface from vanishing; add points on the sides that are missing";
    if (!is_flat) text << ", or try `init = cloud`";
    if (!is_flat && tag_distance < radius)
        text << "; if they surround a body on all sides, try `tag_distance = " << radius << "`";
    text << "; for a closed layer around them set `max_steps = 0, tag_distance = " << layer
         << ", voxel_size = " << layer / kHalfWidthVoxels << "`";
    return text.str();
}

}  // namespace covol::detail
