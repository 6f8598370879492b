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
    Wlop   ///< weighted locally optimal projection (Huang et al. 2009): also evens out the density, robust to outliers
};
template <>
inline constexpr auto kWords<CloudSmoothing> = std::array{"none", "jets", "wlop"};

/// What clean_cloud() does, in this order; by default only duplicates are removed.
struct CloudCleanupOptions {
    bool duplicates = true;  ///< Merges exact duplicates.
    /// > 0: removes the points of find_isolated_points(), and points whose root mean square distance to `neighbours`
    /// others exceeds this many times the cloud's mean of that distance, until no such points remain; >= 1.
    double outlier_factor = 0;
    double simplify = 0;  ///< > 0: keeps one point in each cell of a lattice of this edge, world units.
    CloudSmoothing smooth = CloudSmoothing::None;
    double wlop_fraction = 0.25;  ///< Fraction of the points that WLOP creates, in (0,1].
    /// Radius of WLOP's neighbourhoods, world units, > 0; automatic: twice the mean distance of the new points
    /// to their eight neighbours.
    std::optional<double> wlop_radius;
    int neighbours = 24;  ///< For outliers and jets, >= 6.

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
    std::size_t given = 0;
    std::size_t duplicates = 0;  ///< removed
    std::size_t outliers = 0;    ///< removed
    int outlier_passes = 0;
    std::size_t simplified = 0;  ///< removed
    std::size_t smoothed = 0;    ///< moved
    double mean_shift = 0;       ///< by the jets, world units
    double max_shift = 0;
    std::size_t kept = 0;
};

/// Cleans a cloud with CGAL's point-set processing. The remaining points keep their order, except after WLOP, which
/// creates new ones. The result is bit-identical for any number of threads. One line of the log states what was done.
/// @param report  may be null
/// @throws Error InvalidOptions, InvalidInput (a value that is not finite; no point remains), Numerical (CGAL fails),
///     Cancelled.
[[nodiscard]] COVOL_API std::vector<Vec3> clean_cloud(const std::vector<Vec3>& points,
                                                      const CloudCleanupOptions& options, const RunContext& run = {},
                                                      CloudCleanupReport* report = nullptr);

}  // namespace covol
