#pragma once
// The nearest points of each point.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "points/heuristics.h"
#include "points/point_cells.h"

namespace covol::cloud {

struct Neighbour {
    double squared;    ///< squared distance
    std::uint32_t at;  ///< position in the sorted order
    friend bool operator<(const Neighbour& a, const Neighbour& b) {
        return a.squared != b.squared ? a.squared < b.squared : a.at < b.at;
    }
};

/// Sums of the positions of neighbours relative to a point, and of the outer products of these positions.
struct Moments {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
};
[[nodiscard]] inline Moments moments_of(const PointCells& cells, const Vec3& point,
                                        const std::vector<Neighbour>& near) {
    Moments moments;
    for (const Neighbour& other : near) {
        const Vec3& q = cells.sorted()[other.at];
        const Eigen::Vector3d v(q[0] - point[0], q[1] - point[1], q[2] - point[2]);
        moments.sum += v;
        moments.squares += v * v.transpose();
    }
    return moments;
}

/// Calls visit(point, neighbours), from several threads, with the input index of each point and its `count` nearest
/// other points, the nearest first. There are fewer if the cloud or the last search radius, the first one above
/// kNear.max_radius spacings, contains fewer.
/// @param cells   with an edge of about two spacings
/// @param wanted  function of a point's position in the sorted order: whether the point is visited
template <typename Visit, typename Wanted>
void for_nearest(const PointCells& cells, double spacing, std::size_t count, Visit visit, Wanted wanted) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, cells.sorted().size(), 512), [&](const auto& some) {
        std::vector<PointCells::Range> ranges;
        std::vector<Neighbour> near;
        for (std::size_t n = some.begin(); n < some.end(); ++n) {
            if (!wanted(n)) continue;
            const Vec3& p = cells.sorted()[n];
            for (double r = kNear.first_radius * spacing; r > 0; r *= 2) {
                cells.find(p, r, ranges);
                near.clear();
                for (const PointCells::Range& range : ranges)
                    for (std::uint32_t m = range.begin; m < range.end; ++m) {
                        const Vec3& q = cells.sorted()[m];
                        const double x = q[0] - p[0], y = q[1] - p[1], z = q[2] - p[2], d2 = x * x + y * y + z * z;
                        if (d2 <= r * r && m != n) near.push_back({d2, m});
                    }
                if (near.size() >= count || near.size() + 1 >= cells.sorted().size() || r > kNear.max_radius * spacing)
                    break;
            }
            const std::size_t kept = std::min(count, near.size());
            std::partial_sort(near.begin(), near.begin() + std::ptrdiff_t(kept), near.end());
            near.resize(kept);
            visit(cells.order()[n], near);
        }
    });
}

template <typename Visit>
void for_nearest(const PointCells& cells, double spacing, std::size_t count, Visit visit) {
    for_nearest(cells, spacing, count, visit, [](std::size_t) { return true; });
}

}  // namespace covol::cloud
