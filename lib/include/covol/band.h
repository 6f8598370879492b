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
    std::vector<Vec3> exterior_seeds;  ///< world positions that are outside, in cavities say
};

template <>
inline constexpr auto kOptions<BandOptions> =
    std::tuple{Option{"tag_distance", &BandOptions::tag_distance, kPositiveLength, Group::Start,
                      "D: closes gaps between points up to 2D", "from the points"},
               Option{"exterior_seed", &BandOptions::exterior_seeds, Group::Start,
                      "a position outside the structure, also in a cavity; repeatable"}};

struct BandReport {
    double tag_distance = 0;      ///< D
    double enclosed_volume = 0;   ///< of all that the flood did not reach, world units^3
    double core_volume = 0;       ///< of the part of it with d > D
    bool leaks = false;           ///< no core enclosed at D or a little below, or one appears just above D
    double holding_distance = 0;  ///< where it leaks: the smallest D that would hold, 0 when none was found
    std::int64_t active_voxels = 0;

    /// Where it leaks: what to tell people.
    [[nodiscard]] COVOL_API std::string leak() const;
};

struct BandResult {
    FloatGridPtr grid;  ///< "band": u0, active where d <= D + 3h, +-3h outside; signed flood filled
    BandReport report;
};

/// The D that the points themselves ask for, and how it was found.
struct TagDistanceChoice {
    double tag_distance = 0;
    bool encloses = false;  ///< whether a core that stands out was found
    std::string reason;     ///< one line for people
};

/// Chooses D from the cloud: {d > D} falls apart into the exterior and enclosed cores as D grows; each core
/// appears when its last gap closes (a saddle of d) and vanishes at its inner radius (a peak of d). D is put just
/// above the saddle that closes the main cores. Without a core that stands out, 1.8 times the mean spacing.
/// @throws Error InvalidInput.
[[nodiscard]] COVOL_API TagDistanceChoice choose_tag_distance(const std::vector<Vec3>& points, const Domain& domain,
                                                              const std::vector<Vec3>& exterior_seeds,
                                                              const RunContext& run = {});

/// Tagging. Exterior is what a flood from the domain's boundary and the exterior seeds reaches through {d > D};
/// u0 is the signed distance to the tagged surface clamped to [-3h, 3h] (negative inside) on the band {d <= D + 3h}.
/// Leaks are reported, never thrown.
/// @param distance  from compute_distance(), with max_distance >= D + 3h.
/// @throws Error InvalidOptions, InvalidInput (the tube is too narrow; an exterior seed outside the domain or at d <=
/// D).
[[nodiscard]] COVOL_API BandResult tag_interior(const FloatGrid& distance, const BandOptions& options,
                                                const RunContext& run = {});

/// The closing of a tagged body by a ball: what a ball of radius D that rolls outside the tagged surface of `band`
/// cannot reach with its far side, that is, the exterior grown back by D. Its surface touches the points; a signed
/// distance clamped to 5 voxels. Null where nothing would be left.
[[nodiscard]] COVOL_API FloatGridPtr close_by_ball(const FloatGrid& band, double tag_distance,
                                                   const RunContext& run = {});

}  // namespace covol
