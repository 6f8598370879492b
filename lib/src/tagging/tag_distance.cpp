// The choice of the tag distance D: large enough to close the gaps of the main cores, and no larger.
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/heuristics.h"
#include "covol/band.h"
#include "covol/distance.h"
#include "covol/error.h"
#include "covol/points.h"
#include "tagging/cores.h"
#include "tagging/heuristics.h"

namespace covol {
namespace {

using detail::Core;
using detail::Cores;

/// The domain of the analysis: the points' box with a margin of two voxels, within the given domain.
Domain analysis_domain(const std::vector<Vec3>& points, const Domain& domain, double voxel_size) {
    WorldBox box = bounding_box(points, 2 * voxel_size);
    const WorldBox limit = domain.world_box();
    for (int a = 0; a < 3; ++a) {
        box.min[a] = std::max(box.min[a], limit.min[a]);
        box.max[a] = std::min(box.max[a], limit.max[a]);
        if (!(box.max[a] > box.min[a]))
            throw Error(Errc::InvalidInput, "points: expected at least one in the domain, got none of " +
                                                std::to_string(points.size()) + "; check their coordinates and `roi`");
    }
    return make_domain(box, voxel_size);
}

/// The distance at which the main cores are closed, voxels; 0 if only pockets are enclosed.
struct MainCores {
    double saddle = 0;
    double peak = 0;  ///< of the significant core with the largest full_volume()
    int cores = 0;
};

MainCores judge(const Cores& analysis) {
    MainCores verdict;
    const auto cloud_area = [&](double saddle) {
        const double thickness = std::max(saddle, 1.0);
        return analysis.cloud_volume(thickness) / (2 * thickness);
    };
    const auto is_significant = [&](const Core& c) {
        // Gaps with a radius below half a voxel are not resolved by the grid and count as half a voxel.
        const double ratio = c.peak / std::max(c.saddle, 0.5);
        return c.peak >= 1.0 &&
               (ratio >= kCommon.clear_ratio ||
                (ratio >= kTagDistance.significant_ratio && c.full_area() >= kCommon.minority * cloud_area(c.saddle)));
    };
    const Core* primary = nullptr;
    for (const Core& c : analysis.cores)
        if (is_significant(c) && (!primary || c.full_volume() > primary->full_volume())) primary = &c;
    if (!primary) return verdict;
    double area = 0;
    for (const Core& c : analysis.cores) {
        if (!is_significant(c) || c.full_volume() < kCommon.minority * primary->full_volume()) continue;
        verdict.saddle = std::max(verdict.saddle, c.saddle);
        area += c.full_area();
        ++verdict.cores;
    }
    verdict.peak = primary->peak;
    // If the area of the main cores is only a small fraction of the cloud's area, they are pockets.
    return area < kCommon.minority * cloud_area(verdict.saddle) ? MainCores{} : verdict;
}

}  // namespace

TagDistanceChoice choose_tag_distance(const std::vector<Vec3>& points, const Domain& domain,
                                      const std::vector<Vec3>& exterior_seeds, const RunContext& run) {
    if (points.empty()) throw Error(Errc::InvalidInput, "points: expected at least one, got none");
    const double h = domain.voxel_size;
    const WorldBox box = bounding_box(points);
    const double extent = std::max({box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2], h});
    double volume = 1;
    for (int a = 0; a < 3; ++a) volume *= std::max(box.max[a] - box.min[a], extent / 64);
    // On the first grid the points' box, which the tube fills, has at most an eighth of max_tube_voxels.
    double a = std::max(h, 2 * std::cbrt(volume / double(kTagDistance.max_tube_voxels)));
    double radius = extent;
    TagDistanceChoice choice;
    std::ostringstream reason;
    for (;;) {
        run.check();
        const DistanceResult tube = compute_distance(points, analysis_domain(points, domain, a), {radius}, run);
        if (tube.grid->tree().leafCount() == 0) break;
        Cores analysis;
        with_threads(run, [&] { analysis = detail::find_cores(*tube.grid, radius, exterior_seeds); });
        const MainCores verdict = judge(analysis);
        if (verdict.cores > 0) {
            choice.tag_distance = std::max((verdict.saddle + 0.5) * a, 1.5 * h);
            choice.encloses = true;
            reason.str({});
            reason << "closes " << verdict.cores << (verdict.cores == 1 ? " core" : " cores")
                   << " whose largest gap has radius " << verdict.saddle * a << " (inner radius " << verdict.peak * a
                   << "), found on a grid with cells of " << a;
        }
        const double finer = std::max(h, 0.5 * a);
        const bool is_resolved = verdict.cores > 0 && verdict.saddle >= kHalfWidthVoxels;
        const double next_voxels = double(analysis.tube_voxels) * (a / finer) * (a / finer);
        if (is_resolved || !(finer < a) || next_voxels > double(kTagDistance.max_tube_voxels)) break;
        a = finer;
        radius = std::max(kCommon.growth * choice.tag_distance, (kHalfWidthVoxels + 1) * a);
    }
    if (choice.tag_distance == 0) {
        const double spacing = measure_spacing(merge_close_points(points, 0.0)).mean;
        choice.tag_distance = std::max(1.8 * spacing, 1.5 * h);
        reason << "no closed structure found; "
               << (1.8 * spacing < 1.5 * h ? "1.5 voxels, more than 1.8 times" : "1.8 times") << " the mean spacing "
               << spacing;
    }
    choice.reason = reason.str();
    return choice;
}

}  // namespace covol
