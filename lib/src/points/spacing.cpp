// Duplicates, spatial order and spacing of points.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "covol/domain.h"
#include "covol/error.h"
#include "covol/points.h"
#include "points/heuristics.h"
#include "points/kd_tree.h"

namespace covol {

using detail::squared_distance;

std::vector<Vec3> merge_close_points(const std::vector<Vec3>& points, double cell) {
    if (!(cell >= 0) || !std::isfinite(cell))
        throw Error(Errc::InvalidOptions, "cell: expected >= 0, got " + std::to_string(cell));
    struct Item {
        Vec3 key;  ///< indices of the cell, or the point itself if `cell` is 0
        std::size_t index;
    };
    std::vector<Item> items(points.size());
    for (std::size_t n = 0; n < points.size(); ++n) {
        items[n] = {points[n], n};
        if (cell > 0)
            for (double& x : items[n].key) x = std::floor(x / cell);
    }
    tbb::parallel_sort(items.begin(), items.end(),
                       [](const Item& a, const Item& b) { return a.key != b.key ? a.key < b.key : a.index < b.index; });
    std::vector<std::uint8_t> keep(points.size(), 0);
    const double minimum = 0.25 * cell * cell;
    std::vector<std::size_t> kept;  // kept points of the current cell; few, because they are at least cell / 2 apart
    for (std::size_t n = 0; n < items.size(); ++n) {
        if (n == 0 || items[n].key != items[n - 1].key) kept.clear();
        const Vec3& point = points[items[n].index];
        const bool close = std::any_of(kept.begin(), kept.end(), [&](std::size_t other) {
            const double distance = squared_distance(points[other], point);
            return distance == 0 || distance < minimum;
        });
        if (close) continue;
        kept.push_back(items[n].index);
        keep[items[n].index] = 1;
    }
    std::vector<Vec3> result;
    for (std::size_t n = 0; n < points.size(); ++n)
        if (keep[n] != 0) result.push_back(points[n]);
    return result;
}

std::vector<std::uint32_t> order_spatially(const std::vector<Vec3>& points, std::size_t maximum) {
    if (maximum == 0) throw Error(Errc::InvalidOptions, "maximum: expected > 0, got 0");
    if (points.size() > std::numeric_limits<std::uint32_t>::max())
        throw Error(Errc::InvalidInput, "points: expected fewer than 2^32, got " + std::to_string(points.size()));
    if (points.empty()) return {};
    constexpr int kBits = 10;
    const WorldBox box = bounding_box(points);
    const double longest = longest_side(box);
    const double scale = longest > 0 ? ((1 << kBits) - 1) / longest : 0.0;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> keyed(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        std::uint32_t key = 0;
        for (int a = 0; a < 3; ++a) {
            const auto cell = static_cast<std::uint32_t>((points[n][a] - box.min[a]) * scale);
            for (int bit = 0; bit < kBits; ++bit) key |= (cell >> bit & 1U) << (3 * bit + a);
        }
        keyed[n] = {key, static_cast<std::uint32_t>(n)};
    });
    tbb::parallel_sort(keyed.begin(), keyed.end());
    std::vector<std::uint32_t> order(std::min(points.size(), maximum));
    const double step = double(points.size()) / double(order.size());
    for (std::size_t n = 0; n < order.size(); ++n)
        order[n] = keyed[order.size() < points.size() ? std::size_t((double(n) + 0.5) * step) : n].second;
    return order;
}

SpacingStatistics measure_spacing(const std::vector<Vec3>& points) {
    if (points.size() < 2) return {};
    const std::size_t step = (points.size() + kPointSpacing.queries - 1) / kPointSpacing.queries;
    const detail::KdTree tree(points);
    std::vector<double> distances((points.size() + step - 1) / step);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, distances.size(), 256), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n)
            distances[n] = std::sqrt(tree.nearest_other(points[n * step]));
    });
    std::sort(distances.begin(), distances.end());
    const auto at = [&](double fraction) {
        return distances[static_cast<std::size_t>(std::lround(fraction * double(distances.size() - 1)))];
    };
    SpacingStatistics statistics;
    statistics.mean = std::accumulate(distances.begin(), distances.end(), 0.0) / double(distances.size());
    statistics.median = at(0.5);
    statistics.p95 = at(0.95);
    statistics.max = distances.back();
    return statistics;
}

}  // namespace covol
