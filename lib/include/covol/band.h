#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

struct BandOptions {
    double tag_distance = 0.0;         ///< D, world units; > 0.
    std::vector<Vec3> exterior_seeds;  ///< world positions that are outside, for example in cavities
};

template <>
inline constexpr auto kOptions<BandOptions> =
    std::tuple{Option{"tag_distance", &BandOptions::tag_distance, kPositiveLength, Group::Start,
                      "D: closes gaps between points up to 2D", "from the points"},
               Option{"exterior_seed", &BandOptions::exterior_seeds, Group::Start,
                      "a position outside the structure, for example in a cavity; repeatable"}};

struct BandReport {
    double tag_distance = 0;      ///< D
    double enclosed_volume = 0;   ///< of everything that the flood fill did not reach, world units^3
    double core_volume = 0;       ///< of the part of it where d > D
    bool leaks = false;           ///< no core is enclosed at D or slightly below, or one appears only just above D
    double holding_distance = 0;  ///< if it leaks: the smallest D that would enclose a core; 0 if none was found
    std::int64_t active_voxels = 0;

    /// The message for the user if it leaks.
    [[nodiscard]] COVOL_API std::string leak() const;
};

struct BandResult {
    FloatGridPtr grid;  ///< "band": u0, active where d <= D + 3h, +-3h outside; signed flood filled
    BandReport report;
};

/// The D that is derived from the points, and how it was found.
struct TagDistanceChoice {
    double tag_distance = 0;
    bool encloses = false;  ///< whether a core was found that is clearly distinct from small gaps
    std::string reason;     ///< one line for the user
};

/// Chooses D from the cloud. As D grows, {d > D} falls apart into the exterior and enclosed cores; each core appears
/// when its last gap closes (a saddle of d) and vanishes at its inner radius (a peak of d). D is placed just above the
/// saddle that closes the main cores. If no core is clearly distinct, D is 1.8 times the mean spacing.
/// @throws Error InvalidInput.
[[nodiscard]] COVOL_API TagDistanceChoice choose_tag_distance(const std::vector<Vec3>& points, const Domain& domain,
                                                              const std::vector<Vec3>& exterior_seeds,
                                                              const RunContext& run = {});

/// Tagging. The exterior is what a flood fill from the domain's boundary and the exterior seeds reaches through
/// {d > D}; u0 is the signed distance to the tagged surface, clamped to [-3h, 3h] (negative inside), on the band
/// {d <= D + 3h}. Leaks are reported, not thrown.
/// @param distance  from compute_distance(), with max_distance >= D + 3h.
/// @throws Error InvalidOptions, InvalidInput (the tube is too narrow; an exterior seed outside the domain or at d <=
///     D).
[[nodiscard]] COVOL_API BandResult tag_interior(const FloatGrid& distance, const BandOptions& options,
                                                const RunContext& run = {});

/// The closing of a tagged body by a ball: the exterior of `band` is dilated by D, and the body is what remains, that
/// is, what a ball of radius D that rolls along the outside of the tagged surface does not cover. Its surface touches
/// the points. The result is a signed distance clamped to 5 voxels, or null if nothing would remain.
[[nodiscard]] COVOL_API FloatGridPtr close_by_ball(const FloatGrid& band, double tag_distance,
                                                   const RunContext& run = {});

}  // namespace covol
