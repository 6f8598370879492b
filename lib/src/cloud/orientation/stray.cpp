#include "cloud/orientation/stray.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "base/median.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/orientation/heuristics.h"
#include "cloud/orientation/judge.h"
#include "points/heuristics.h"
#include "points/neighbours.h"

namespace covol::cloud {
namespace {

constexpr std::size_t kBeside = 16;

/// Median distance to the last of kCommon.ring neighbours, over a sample of the points.
double usual_reach(const PointCells& cells, double spacing) {
    const std::size_t count = cells.sorted().size(), step = std::max<std::size_t>(1, count / kCommon.sample);
    std::vector<double> reach(count, -1);
    for_nearest(
        cells, spacing, kCommon.ring,
        [&](std::uint32_t point, const std::vector<Neighbour>& near) {
            reach[point] = near.size() < kCommon.ring ? 1e300 : std::sqrt(near.back().squared);
        },
        [&](std::size_t n) { return n % step == 0; });
    std::erase(reach, -1);
    return median(std::move(reach));
}

/// Whether fewer than kCommon.ring other points are closer than `distance` to point n.
bool is_isolated(const PointCells& cells, std::size_t n, double distance, std::vector<PointCells::Range>& ranges) {
    const Vec3& p = cells.sorted()[n];
    std::size_t found = 0;
    const auto has_enough_neighbours = [&](std::size_t begin, std::size_t end) {
        for (std::size_t m = begin; m < end && found < kCommon.ring; ++m) {
            const Vec3 to = minus(cells.sorted()[m], p);
            found += m != n && dot(to, to) <= distance * distance;
        }
        return found >= kCommon.ring;
    };
    // For most points, the points next to them in the sorted order include enough neighbours, so that no search is
    // needed.
    if (has_enough_neighbours(n - std::min(n, kBeside), std::min(n + kBeside, cells.sorted().size()))) return false;
    found = 0;
    cells.find(p, distance, ranges);
    return std::none_of(ranges.begin(), ranges.end(),
                        [&](const PointCells::Range& range) { return has_enough_neighbours(range.begin, range.end); });
}

}  // namespace

std::vector<char> find_stray(const std::vector<Vec3>& points, const CloudScale& scale, const RunContext& run) {
    std::vector<char> stray(points.size(), 0);
    if (points.size() <= 2 * kCommon.ring) return stray;
    const PointCells cells(points, kNear.first_radius * apart(scale));
    const double far_reach = kStray.far * usual_reach(cells, scale.spacing);
    run.check();
    std::vector<char> isolated(points.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 1024), [&](const auto& some) {
        std::vector<PointCells::Range> ranges;
        for (std::size_t n = some.begin(); n < some.end(); ++n) isolated[n] = is_isolated(cells, n, far_reach, ranges);
    });
    run.check();
    for_nearest(
        cells, scale.spacing, kCommon.ring,
        [&](std::uint32_t point, const std::vector<Neighbour>& near) {
            stray[point] = 1;
            if (near.size() < kCommon.ring) return;
            const auto [whole, squares] = moments_of(cells, points[point], near);
            const double count = double(near.size());
            const Eigen::Vector3d mean = whole / count;
            const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares / count - mean * mean.transpose());
            const double deviation = std::sqrt(std::max(0.0, axes.eigenvalues()[0])),
                         reach = std::sqrt(near.back().squared);
            // The more distant the neighbours are, the smaller is the value of `off` above which the point is stray.
            const double off = std::max(deviation, std::abs(axes.eigenvectors().col(0).dot(mean))) / reach;
            stray[point] = off * reach / far_reach > kCloud.flat;
        },
        [&](std::size_t n) { return isolated[n] != 0; });
    return stray;
}

}  // namespace covol::cloud
