#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

struct BandOptions {
    /// the tag distance D, half of the widest gap between points that is closed; world units, > 0
    double tag_distance = 0.0;
    std::vector<Vec3> exterior_seeds;  ///< world positions that are outside, for example in cavities
};

template <>
inline constexpr auto kOptions<BandOptions> =
    std::tuple{Option{"tag_distance", &BandOptions::tag_distance, kPositiveLength, Group::Start,
                      "D: closes gaps between points up to 2D", "from the points"},
               Option{"exterior_seed", &BandOptions::exterior_seeds, Group::Start,
                      "a position outside the structure, for example in a cavity; repeatable"}};

struct BandReport {
    double tag_distance = 0;     ///< the value of BandOptions::tag_distance that was used
    double enclosed_volume = 0;  ///< volume of the voxels that the flood fill did not reach, world units^3
    /// volume of the cores, that is, of the voxels that the flood fill did not reach and that are farther than
    /// `tag_distance` from all points; world units^3
    double core_volume = 0;
    /// Whether the points have gaps that the tag distance D does not close. Either the body contains no core (a part
    /// farther than D from all points), neither for D nor for three smaller distances down to 0.6 D, or it contains one
    /// and would contain a further one if it were tagged with D + h, where h is the voxel size.
    bool leaks = false;
    /// If the body leaks: the smallest tested tag distance above the one used, in world units, with which the body
    /// would contain a further core (a part farther than the tag distance from all points); 0 if none was found.
    double holding_distance = 0;
    std::int64_t active_voxels = 0;

    /// The message for the user; only meaningful if `leaks` is set.
    [[nodiscard]] COVOL_API std::string leak() const;
};

struct BandResult {
    /// The initial level set u0, named "band". It is active where d <= D + 3h, with d the distance to the points and h
    /// the voxel size; all other voxels are 3h outside of the body and -3h inside.
    FloatGridPtr grid;
    BandReport report;
};

/// The tag distance D that was derived from the points, and how it was found.
struct TagDistanceChoice {
    double tag_distance = 0;
    /// whether the points enclose a core (see choose_tag_distance()) that is not just a small gap between them
    bool encloses = false;
    std::string reason;  ///< how the value was found, one line for the user
};

/// Chooses D from the points. Let d be the distance to the nearest point. As D grows, the set {d > D} splits into the
/// exterior and enclosed cores; each core appears when its last gap closes (at a saddle of d) and vanishes at its inner
/// radius (a maximum of d). D is chosen just above the largest saddle of the main cores, that is, of those whose inner
/// radius clearly exceeds their saddle and which are not small compared with the largest one. If there are none, D is
/// 1.8 times the mean spacing. D is at least 1.5 voxels.
/// @throws Error InvalidInput (no point, or none in the domain).
[[nodiscard]] COVOL_API TagDistanceChoice choose_tag_distance(const std::vector<Vec3>& points, const Domain& domain,
                                                              const std::vector<Vec3>& exterior_seeds,
                                                              const RunContext& run = {});

/// Tags the inside. The exterior is the region that a flood fill from the domain's boundary and the exterior seeds
/// reaches through the set {d > D}; u0 is the signed distance to the tagged surface, clamped to [-3h, 3h] (negative
/// inside), on the band {d <= D + 3h}. Leaks are reported and throw no error.
/// @param distance  from compute_distance(), with max_distance >= D + 3h.
/// @throws Error InvalidOptions, InvalidInput (the tube is too narrow; an exterior seed outside the domain or at d <=
///     D).
[[nodiscard]] COVOL_API BandResult tag_interior(const FloatGrid& distance, const BandOptions& options,
                                                const RunContext& run = {});

/// Shrinks a tagged body back to the points: removes from the inside of `band` every voxel that is closer than D to the
/// tagged surface, which lies about D outside of the points. Together, tagging and this step are a morphological
/// closing by a ball of radius D. The result is a signed distance, clamped to 5 voxels, or null if nothing remains.
[[nodiscard]] COVOL_API FloatGridPtr close_by_ball(const FloatGrid& band, double tag_distance,
                                                   const RunContext& run = {});

}  // namespace covol
