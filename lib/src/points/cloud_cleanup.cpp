#include "covol/cloud_cleanup.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/compute_average_spacing.h>
#include <CGAL/grid_simplify_point_set.h>
#include <CGAL/jet_smooth_point_set.h>
#include <CGAL/property_map.h>
#include <CGAL/remove_outliers.h>
#include <CGAL/wlop_simplify_and_regularize_point_set.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <utility>

#include "base/heuristics.h"
#include "covol/error.h"
#include "covol/points.h"

namespace covol {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
/// A point and its index in the input, because CGAL's algorithms reorder points.
using Entry = std::pair<Point, std::size_t>;
using PointMap = CGAL::First_of_pair_property_map<Entry>;
using Tag = CGAL::Parallel_tag;

constexpr std::size_t kFewest = 7;  // minimum number of points, so that each has six neighbours

class Cleaner {
    // See not_cancelled_ about how CGAL stores its arguments.
    [[nodiscard]] auto parameters() const { return CGAL::parameters::point_map(point_map_).callback(not_cancelled_); }

public:
    Cleaner(const std::vector<Vec3>& points, const CloudCleanupOptions& options, const RunContext& run)
        : options_(options), run_(run) {
        entries_.reserve(points.size());
        for (const Vec3& p : points) entries_.emplace_back(Point(p[0], p[1], p[2]), entries_.size());
    }

    void remove_outliers(CloudCleanupReport& report) {
        report.outliers += remove_isolated();
        while (report.outlier_passes < kCommon.rounds && entries_.size() >= kFewest) {
            run_.check();
            const double mean = CGAL::compute_average_spacing<Tag>(entries_, neighbours(), parameters());
            run_.check();
            const auto end = CGAL::remove_outliers<Tag>(
                entries_, neighbours(),
                parameters().threshold_percent(100.0).threshold_distance(options_.outlier_factor * mean));
            const std::size_t removed = keep_until(end);
            ++report.outlier_passes;
            report.outliers += removed;
            if (removed == 0) return;
        }
    }

    void simplify(CloudCleanupReport& report) {
        run_.check();
        report.simplified = keep_until(CGAL::grid_simplify_point_set(entries_, options_.simplify, parameters()));
    }

    void smooth_by_jets(CloudCleanupReport& report) {
        if (entries_.size() < kFewest) return;
        run_.check();
        const std::vector<Entry> before = entries_;
        CGAL::jet_smooth_point_set<Tag>(entries_, neighbours(), parameters());
        run_.check();
        double sum = 0;
        for (std::size_t n = 0; n < entries_.size(); ++n) {
            // The result is not finite for points on a line, to which no quadric can be fitted.
            if (!is_finite(entries_[n].first)) entries_[n] = before[n];
            const double shift = std::sqrt(CGAL::squared_distance(entries_[n].first, before[n].first));
            sum += shift;
            report.max_shift = std::max(report.max_shift, shift);
            report.smoothed += shift > 0 ? 1 : 0;
        }
        report.mean_shift = sum / double(entries_.size());
    }

    void smooth_by_wlop(CloudCleanupReport& report) {
        if (entries_.size() < kFewest) return;
        run_.check();
        // The automatic radius is twice the mean distance of the new points to their eight neighbours; CGAL's default
        // of 8 spacings flattens curved surfaces.
        const auto automatic = [&] {
            const double ring = CGAL::compute_average_spacing<Tag>(entries_, unsigned(kCommon.ring), parameters());
            return 2 * ring / std::sqrt(options_.wlop_fraction);
        };
        const double radius = options_.wlop_radius ? *options_.wlop_radius : automatic();
        run_.check();
        std::vector<Point> points;
        CGAL::wlop_simplify_and_regularize_point_set<Tag>(
            entries_, std::back_inserter(points),
            parameters().select_percentage(100 * options_.wlop_fraction).neighbor_radius(radius));
        run_.check();
        std::erase_if(points, [](const Point& p) { return !is_finite(p); });
        entries_.clear();
        for (const Point& p : points) entries_.emplace_back(p, entries_.size());
        report.smoothed = entries_.size();
    }

    [[nodiscard]] std::vector<Vec3> points() const {
        std::vector<Vec3> result;
        for (const auto& [p, index] : entries_) result.push_back({p.x(), p.y(), p.z()});
        return result;
    }

private:
    /// Removes the points of find_isolated_points(). In small clouds, the distances to `neighbours` others do not
    /// distinguish them, because these distances are long for all points.
    std::size_t remove_isolated() {
        std::set<std::size_t> isolated;
        for (const IsolatedPoint& one : find_isolated_points(points())) isolated.insert(entries_[one.index].second);
        return std::erase_if(entries_, [&](const Entry& entry) { return isolated.contains(entry.second); });
    }

    [[nodiscard]] unsigned neighbours() const {
        return static_cast<unsigned>(std::min<std::size_t>(std::size_t(options_.neighbours), entries_.size() - 1));
    }
    /// Removes the entries from `end` on and sorts the others into the input's order. @return the number removed
    std::size_t keep_until(std::vector<Entry>::iterator end) {
        run_.check();
        const auto removed = static_cast<std::size_t>(entries_.end() - end);
        entries_.erase(end, entries_.end());
        std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return a.second < b.second; });
        return removed;
    }
    static bool is_finite(const Point& p) {
        return std::isfinite(p.x()) && std::isfinite(p.y()) && std::isfinite(p.z());
    }

    const CloudCleanupOptions& options_;
    const RunContext& run_;
    const PointMap point_map_{};
    /// The progress callback, which CGAL may call from another thread; if it returns false, CGAL stops.
    struct NotCancelled {
        const RunContext& run;
        bool operator()(double) const { return !run.cancelled(); }
    };
    // This is not a std::function, because CGAL 5.5 would keep a reference to a temporary copy of it. Of other
    // callables, CGAL stores a copy.
    const NotCancelled not_cancelled_{run_};
    std::vector<Entry> entries_;
};

std::vector<Vec3> clean(const std::vector<Vec3>& points, const CloudCleanupOptions& options, const RunContext& run,
                        CloudCleanupReport& report) {
    std::vector<Vec3> distinct = options.duplicates ? merge_close_points(points, 0) : points;
    report.duplicates = points.size() - distinct.size();
    if (distinct.empty() || !options.any()) return distinct;
    Cleaner cleaner(distinct, options, run);
    if (options.outlier_factor > 0) cleaner.remove_outliers(report);
    if (options.simplify > 0) cleaner.simplify(report);
    if (options.smooth == CloudSmoothing::Jets) cleaner.smooth_by_jets(report);
    if (options.smooth == CloudSmoothing::Wlop) cleaner.smooth_by_wlop(report);
    return cleaner.points();
}

std::string one_line(const CloudCleanupReport& r, const CloudCleanupOptions& options) {
    std::ostringstream text;
    text << "cloud: " << r.kept << " of " << r.given << " points kept; " << r.duplicates << " duplicates";
    if (options.outlier_factor > 0) text << ", " << r.outliers << " outliers in " << r.outlier_passes << " passes";
    if (options.simplify > 0) text << ", " << r.simplified << " by cells of " << options.simplify;
    if (options.smooth == CloudSmoothing::Jets)
        text << "; jets moved " << r.smoothed << " by " << r.mean_shift << " on average, " << r.max_shift << " at most";
    if (options.smooth == CloudSmoothing::Wlop) text << "; WLOP generated " << r.smoothed;
    return text.str();
}

}  // namespace

std::vector<Vec3> clean_cloud(const std::vector<Vec3>& points, const CloudCleanupOptions& options,
                              const RunContext& run, CloudCleanupReport* report) {
    require_valid(options, "clean_cloud");
    for (const Vec3& p : points)
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
            throw Error(Errc::InvalidInput, "points: expected finite numbers");
    CloudCleanupReport own;
    own.given = points.size();
    std::vector<Vec3> result;
    try {
        with_threads(run, [&] { result = clean(points, options, run, own); });
    } catch (const CGAL::Failure_exception& e) {
        throw Error(Errc::Numerical, std::string("CGAL: ") + e.what());
    }
    own.kept = result.size();
    if (result.empty() && !points.empty())
        throw Error(Errc::InvalidInput, "none of the " + std::to_string(points.size()) +
                                            " points remains; leave out `remove_outliers` or `smooth`");
    if (report != nullptr) *report = own;
    run.info(one_line(own, options));
    return result;
}

}  // namespace covol
