#pragma once
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

struct DistanceOptions {
    double max_distance = 0.0;  ///< Radius of the tube in which distances are computed, world units, > 0.
};

template <>
inline constexpr auto kOptions<DistanceOptions> = std::tuple{Option{
    "max_distance", &DistanceOptions::max_distance, kPositiveLength, Group::Domain, "radius of the tube", "10vx"}};

struct DistanceReport {
    std::int64_t active_voxels = 0;
    int rounds = 0;  ///< number of passes over the leaves until nothing changed
};

struct DistanceResult {
    FloatGridPtr grid;  ///< named "distance"; active where d <= max_distance, background = max_distance
    DistanceReport report;
};

/// Unsigned distance from voxel centres to the nearest point, in the tube d <= max_distance within the domain.
///
/// Each voxel stores the index of the nearest point found so far; these indices are passed to neighbouring voxels in
/// the 8 orderings of fast sweeping (Zhao 2005), leaf by leaf. Every value is therefore the exact distance to some
/// point, almost always to the nearest one. Values do not depend on the number of threads.
/// @param points  world positions, finite, at least one; points outside the domain are included.
/// @throws Error InvalidOptions, InvalidInput.
[[nodiscard]] COVOL_API DistanceResult compute_distance(const std::vector<Vec3>& points, const Domain& domain,
                                                        const DistanceOptions& options, const RunContext& run = {});

}  // namespace covol
