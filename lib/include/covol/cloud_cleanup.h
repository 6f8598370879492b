#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

enum class CloudSmoothing {
    None,
    Jets,  ///< each point is moved onto a quadric fitted to its neighbours (Cazals and Pouget 2005)
    Wlop   ///< weighted locally optimal projection (Huang et al. 2009): creates fewer, evenly spread points; robust to
           ///< outliers
};
template <>
inline constexpr auto kWords<CloudSmoothing> = std::array{"none", "jets", "wlop"};

/// The steps of clean_cloud(), in the order in which they are applied; by default only duplicates are removed.
struct CloudCleanupOptions {
    bool duplicates = true;  ///< Merges exact duplicates.
    /// 0: outliers are kept; >= 1: removes the points of find_isolated_points(), then, at most four times, all points
    /// whose root mean square distance to their `neighbours` nearest points exceeds this factor times the mean distance
    /// between neighbours in the cloud.
    double outlier_factor = 0;
    /// > 0: keeps one point in each cell of a lattice with cells of this edge length, world units.
    double simplify = 0;
    CloudSmoothing smooth = CloudSmoothing::None;
    double wlop_fraction = 0.25;  ///< Number of points that WLOP creates, as a fraction of its input, in (0,1].
    /// Radius of WLOP's neighbourhoods, world units, > 0; automatic: twice the mean distance of the new points to their
    /// eight nearest neighbours.
    std::optional<double> wlop_radius;
    int neighbours = 24;  ///< Number of nearest neighbours used for outliers and jets, >= 6.

    /// Whether anything other than the removal of duplicates is requested.
    [[nodiscard]] bool any() const { return outlier_factor > 0 || simplify > 0 || smooth != CloudSmoothing::None; }
};

template <>
inline constexpr auto kOptions<CloudCleanupOptions> =
    std::tuple{Option{"duplicates", &CloudCleanupOptions::duplicates},
               Option{"remove_outliers", &CloudCleanupOptions::outlier_factor, kNotNegative, Group::Clouds,
                      "drop marks that are far from all others, and points whose distance to their 24 nearest "
                      "neighbours is more than 3 (or FACTOR) times the mean of the cloud"},
               Option{"simplify", &CloudCleanupOptions::simplify, kLength, Group::Clouds,
                      "keep one point in each cell of this edge length, for example 1vx"},
               Option{"smooth", &CloudCleanupOptions::smooth, Group::Clouds,
                      "move the points onto fitted quadrics (jets), or project 0.25 times as many, evenly spread, onto "
                      "the surface (wlop)"},
               Option{"wlop_share", &CloudCleanupOptions::wlop_fraction, Range{0, 1, true}},
               Option{"wlop_radius", &CloudCleanupOptions::wlop_radius, kPositive},
               Option{"neighbours", &CloudCleanupOptions::neighbours, at_least(6)},
               Rule<CloudCleanupOptions>{"remove_outliers", "0 or >= 1", [](const CloudCleanupOptions& o) {
                                             return o.outlier_factor <= 0 || o.outlier_factor >= 1;
                                         }}};

struct CloudCleanupReport {
    std::size_t given = 0;       ///< number of points before cleaning
    std::size_t duplicates = 0;  ///< number of points removed as duplicates
    std::size_t outliers = 0;    ///< number of points removed as outliers
    int outlier_passes = 0;
    std::size_t simplified = 0;  ///< number of points removed by `simplify`
    std::size_t smoothed = 0;    ///< number of points that the jets moved or that WLOP created
    double mean_shift = 0;       ///< mean distance by which the jets moved the points, world units; 0 without jets
    double max_shift = 0;        ///< maximum of that distance
    std::size_t kept = 0;        ///< number of points after cleaning
};

/// Cleans a cloud with CGAL's point-set processing. The remaining points keep their order, except after WLOP, which
/// creates new points. The result is bit-identical for any number of threads. One log line summarises the changes.
/// @param report  may be null
/// @throws Error InvalidOptions, InvalidInput (a value that is not finite; no point remains), Numerical (CGAL fails),
///     Cancelled.
[[nodiscard]] COVOL_API std::vector<Vec3> clean_cloud(const std::vector<Vec3>& points,
                                                      const CloudCleanupOptions& options, const RunContext& run = {},
                                                      CloudCleanupReport* report = nullptr);

}  // namespace covol
