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
    Jets,  ///< each point moves to a quadric fitted to its neighbours (Cazals and Pouget 2005)
    Wlop   ///< weighted locally optimal projection (Huang et al. 2009): evens out the density too, outliers matter
           ///< little
};
template <>
inline constexpr auto kWords<CloudSmoothing> = std::array{"none", "jets", "wlop"};

/// What clean_cloud() does, in this order; every step is off unless asked for.
struct CloudCleanupOptions {
    bool duplicates = true;     ///< Exact duplicates become one.
    double outlier_factor = 0;  ///< > 0: those of find_isolated_points() go, and points whose root mean square distance
                                ///< to `neighbours` others exceeds this many times the cloud's mean distance to them,
                                ///< until none is left; >= 1.
    double simplify = 0;        ///< > 0: one point stays in each cell of a lattice of this edge, world units.
    CloudSmoothing smooth = CloudSmoothing::None;
    double wlop_fraction = 0.25;  ///< Of the points, that WLOP makes anew, in (0,1].
    /// Of WLOP's neighbourhoods, world units, > 0; automatic: 2.5 mean spacings of the new points.
    std::optional<double> wlop_radius;
    int neighbours = 24;  ///< For outliers and jets, >= 6.

    /// Whether anything but duplicates is asked for.
    [[nodiscard]] bool any() const { return outlier_factor > 0 || simplify > 0 || smooth != CloudSmoothing::None; }
};

template <>
inline constexpr auto kOptions<CloudCleanupOptions> = std::tuple{
    Option{"duplicates", &CloudCleanupOptions::duplicates},
    Option{"remove_outliers", &CloudCleanupOptions::outlier_factor, kNotNegative, Group::Clouds,
           "drop marks that lie apart from all others, and points whose distance to their 24 neighbours is more than 3 "
           "(or FACTOR) times the cloud's mean"},
    Option{"simplify", &CloudCleanupOptions::simplify, kLength, Group::Clouds,
           "keep one point in each cell of this edge, 1vx for example"},
    Option{"smooth", &CloudCleanupOptions::smooth, Group::Clouds,
           "move the points to fitted quadrics (jets), or make 0.25 times as many by projection, evenly spread (wlop)"},
    Option{"wlop_share", &CloudCleanupOptions::wlop_fraction, Range{0, 1, true}},
    Option{"wlop_radius", &CloudCleanupOptions::wlop_radius, kPositive},
    Option{"neighbours", &CloudCleanupOptions::neighbours, at_least(6)},
    Rule<CloudCleanupOptions>{"remove_outliers", "0 or >= 1", [](const CloudCleanupOptions& o) {
                                  return o.outlier_factor <= 0 || o.outlier_factor >= 1;
                              }}};

struct CloudCleanupReport {
    std::size_t given = 0;
    std::size_t duplicates = 0;  ///< removed
    std::size_t outliers = 0;    ///< removed
    int outlier_passes = 0;
    std::size_t simplified = 0;  ///< removed
    std::size_t smoothed = 0;    ///< moved
    double mean_shift = 0;       ///< of the jets, world units
    double max_shift = 0;
    std::size_t kept = 0;
};

/// Cleans a cloud with CGAL's point-set processing. The order of the points that stay is kept, up to WLOP, which makes
/// new ones. The same bits for any number of threads. One line of the log says what was done.
/// @param report  may be null
/// @throws Error InvalidOptions, InvalidInput (a value that is not finite; no point is left), Numerical (CGAL refuses),
/// Cancelled.
[[nodiscard]] COVOL_API std::vector<Vec3> clean_cloud(const std::vector<Vec3>& points,
                                                      const CloudCleanupOptions& options, const RunContext& run = {},
                                                      CloudCleanupReport* report = nullptr);

}  // namespace covol
