#include "points/kd_tree.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace covol::detail {
namespace {

constexpr std::size_t kLeaf = 12;
constexpr std::size_t kParallel = 20000;

}  // namespace

struct KdTree::Search {
    Vec3 query;
    double best;
    bool skip_self;  ///< the next point at distance 0 is the query itself, which is to be skipped
    const Vec3* at = nullptr;
};

void KdTree::build(std::size_t begin, std::size_t end) {
    if (end - begin <= kLeaf) return;
    Vec3 lo = points_[begin], hi = points_[begin];
    for (std::size_t n = begin; n < end; ++n)
        for (int a = 0; a < 3; ++a) {
            lo[a] = std::min(lo[a], points_[n][a]);
            hi[a] = std::max(hi[a], points_[n][a]);
        }
    int axis = 0;
    for (int a = 1; a < 3; ++a)
        if (hi[a] - lo[a] > hi[axis] - lo[axis]) axis = a;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto first = points_.begin();
    std::nth_element(first + std::ptrdiff_t(begin), first + std::ptrdiff_t(middle), first + std::ptrdiff_t(end),
                     [axis](const Vec3& p, const Vec3& q) { return p[axis] < q[axis]; });
    axis_[middle] = static_cast<std::uint8_t>(axis);
    if (end - begin > kParallel)
        tbb::parallel_invoke([&] { build(begin, middle); }, [&] { build(middle + 1, end); });
    else {
        build(begin, middle);
        build(middle + 1, end);
    }
}

void KdTree::visit(const Vec3& point, Search& search) const {
    const double distance = squared_distance(point, search.query);
    if (distance == 0 && search.skip_self)
        search.skip_self = false;
    else if (distance < search.best) {
        search.best = distance;
        search.at = &point;
    }
}

void KdTree::descend(std::size_t begin, std::size_t end, Search& search) const {
    if (end - begin <= kLeaf) {
        for (std::size_t n = begin; n < end; ++n) visit(points_[n], search);
        return;
    }
    const std::size_t middle = begin + (end - begin) / 2;
    const int axis = axis_[middle];
    const double to_plane = search.query[axis] - points_[middle][axis];
    visit(points_[middle], search);
    const bool left = to_plane < 0;
    descend(left ? begin : middle + 1, left ? middle : end, search);
    if (to_plane * to_plane <= search.best) descend(left ? middle + 1 : begin, left ? end : middle, search);
}

KdTree::KdTree(std::vector<Vec3> points) : points_(std::move(points)), axis_(points_.size()) {
    build(0, points_.size());
}

double KdTree::nearest(const Vec3& query) const {
    Search search{query, std::numeric_limits<double>::infinity(), false};
    descend(0, points_.size(), search);
    return search.best;
}

Vec3 KdTree::nearest_point(const Vec3& query) const {
    Search search{query, std::numeric_limits<double>::infinity(), false};
    descend(0, points_.size(), search);
    return *search.at;
}

const Vec3* KdTree::nearest_within(const Vec3& query, double distance) const {
    Search search{query, distance * distance, false};
    descend(0, points_.size(), search);
    return search.at;
}

double KdTree::nearest_other(const Vec3& query) const {
    Search search{query, std::numeric_limits<double>::infinity(), true};
    descend(0, points_.size(), search);
    return search.best;
}

}  // namespace covol::detail
