// Finds misplaced marks by single-linkage clustering, whose links are the edges of the minimum spanning tree.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/disjoint_sets.h"
#include "base/heuristics.h"
#include "covol/points.h"
#include "points/kd_tree.h"

namespace covol {
namespace {

struct Link {
    double length;
    std::size_t from, to;
};

/// The edges of the minimum spanning tree by Prim's algorithm, sorted by length.
std::vector<Link> shortest_tree(const std::vector<Vec3>& points) {
    std::vector<double> squared(points.size(), std::numeric_limits<double>::infinity());
    std::vector<std::size_t> nearest(points.size(), 0), left(points.size() - 1);
    std::iota(left.begin(), left.end(), std::size_t(1));
    std::vector<Link> links;
    for (std::size_t last = 0; !left.empty();) {
        std::size_t next = 0;
        for (std::size_t k = 0; k < left.size(); ++k) {
            const std::size_t n = left[k];
            const double d = detail::squared_distance(points[n], points[last]);
            if (d < squared[n]) {
                squared[n] = d;
                nearest[n] = last;
            }
            if (squared[n] < squared[left[next]]) next = k;
        }
        last = left[next];
        links.push_back({std::sqrt(squared[last]), nearest[last], last});
        left[next] = left.back();
        left.pop_back();
    }
    std::sort(links.begin(), links.end(),
              [](const Link& a, const Link& b) { return a.length != b.length ? a.length < b.length : a.to < b.to; });
    return links;
}

/// Groups of points that are joined by links. A group is identified by the smallest index of its points.
class Groups {
public:
    explicit Groups(std::size_t points) : sets_(points), size_(points, 1), places_(points) {}
    std::uint32_t of(std::size_t point) { return sets_.root(std::uint32_t(point)); }
    void join(const Link& link) {
        const auto [minimum, other] = std::minmax({of(link.from), of(link.to)});
        sets_.unite(minimum, other);
        large_ -= is_large(minimum) + is_large(other);
        size_[minimum] += size_[other];
        large_ += is_large(minimum);
        if (size_[minimum] > size_[largest_]) largest_ = minimum;
    }
    /// Joins two points at the same position, which then count as one. @pre join() has not been called
    void merge(const Link& link) {
        sets_.unite(of(link.from), of(link.to));
        --places_;
    }
    [[nodiscard]] std::size_t places() const { return places_; }
    [[nodiscard]] std::uint32_t largest() const { return largest_; }
    /// Whether all groups but the largest have fewer than four points, and few points in total.
    [[nodiscard]] bool largest_is_all_but_few() const {
        return large_ == 1 && double(size_[largest_]) >= (1 - kCommon.minority) * double(places_);
    }

private:
    /// 1 if the group has at least four points, which can enclose a volume and may thus be a structure; else 0.
    [[nodiscard]] int is_large(std::uint32_t group) const { return size_[group] >= 4; }

    detail::DisjointSets sets_;
    std::vector<std::size_t> size_;  ///< number of distinct positions in each group
    std::size_t places_;
    std::uint32_t largest_ = 0;
    int large_ = 0;
};

std::vector<IsolatedPoint> points_outside(std::uint32_t group, Groups& groups, const std::vector<Vec3>& points) {
    std::vector<IsolatedPoint> outside;
    for (std::size_t n = 0; n < points.size(); ++n) {
        if (groups.of(n) == group) continue;
        double squared = std::numeric_limits<double>::infinity();
        for (std::size_t m = 0; m < points.size(); ++m)
            if (groups.of(m) == group) squared = std::min(squared, detail::squared_distance(points[n], points[m]));
        outside.push_back({n, std::sqrt(squared)});
    }
    std::stable_sort(outside.begin(), outside.end(),
                     [](const IsolatedPoint& a, const IsolatedPoint& b) { return a.distance > b.distance; });
    return outside;
}

}  // namespace

std::vector<IsolatedPoint> find_isolated_points(const std::vector<Vec3>& points) {
    if (points.size() < 2 || points.size() > kCommon.sample) return {};
    const std::vector<Link> links = shortest_tree(points);
    Groups groups(points.size());
    // Marks at the same position are merged first, because any other link would count as long in comparison with the
    // links between them.
    const auto first =
        std::size_t(std::upper_bound(links.begin(), links.end(), kCommon.same_place * links.back().length,
                                     [](double length, const Link& link) { return length < link.length; }) -
                    links.begin());
    for (std::size_t n = 0; n < first; ++n) groups.merge(links[n]);
    if (groups.places() < 2) return {};
    // Links are compared with the longest one that is not an exception.
    const double usual = links[first + std::size_t((1 - kCommon.minority) * double(links.size() - first))].length;
    for (std::size_t n = first; n + 1 < links.size(); ++n) {
        groups.join(links[n]);
        const bool is_long = links[n + 1].length > kCommon.clear_ratio * usual;
        if (is_long && groups.largest_is_all_but_few()) return points_outside(groups.largest(), groups, points);
    }
    return {};
}

}  // namespace covol
