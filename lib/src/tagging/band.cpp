// Tagging: the region that a flood from outside cannot reach through {d > D} is inside ("3D image segmentation
// supported by a point cloud", section 3). The flood processes blocks without a leaf as a whole, and leaves by 512-bit
// masks.
#include "covol/band.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/heuristics.h"
#include "base/number.h"
#include "covol/error.h"
#include "redistance/signed_distance.h"
#include "tagging/tagging.h"

namespace covol {
namespace {

using detail::Coord;
using detail::kLeafSize;
using detail::LeafArray;
using detail::LeafMask;
using detail::Tagging;
using detail::Tube;

constexpr auto kWidth = float(kHalfWidthVoxels);
/// Determines whether the tagged body leaks at D, and the smallest larger distance at which it does not. A core, which
/// is an enclosed region of {d > D}, appears as soon as D closes the last gap around it: if one appears just above D,
/// the body leaks at D.
void test_for_leaks(const Tube& tube, const Tagging& tagging, double limit, const std::vector<Coord>& seeds,
                    const RunContext& run, BandReport& report) {
    const double h = tube.domain.voxel_size, tag_distance = tagging.distance;
    const auto closes_at = [&](double larger) {
        return detail::closes_a_core(tube, tagging, detail::tag(tube, float(larger), seeds));
    };
    if (tagging.has_core(h)) {
        report.leaks = closes_at(tag_distance + h);
    } else {
        // If there is a core for a smaller distance, down to 0.6 D, the body is thin and closed. Otherwise only walls
        // around the points were tagged.
        report.leaks = true;
        double smaller = tag_distance;
        for (int n = 0; report.leaks && n < 3; ++n) {
            smaller /= std::sqrt(kCommon.growth);
            report.leaks = !detail::tag(tube, float(smaller), seeds).has_core(h);
        }
    }
    if (!report.leaks) return;
    for (double larger = tag_distance + 0.5 * h; larger <= limit && report.holding_distance == 0; larger += 0.5 * h) {
        run.check();
        if (closes_at(larger)) report.holding_distance = larger;
    }
}

using detail::to_text;

std::vector<Coord> seed_voxels(const FloatGrid& distance, const Domain& domain, const BandOptions& options) {
    std::vector<Coord> voxels;
    for (const Vec3& seed : options.exterior_seeds) {
        if (!domain.contains(seed)) {
            const WorldBox box = domain.world_box();
            throw Error(Errc::InvalidInput, "exterior seed " + to_text(seed) + ": expected a position in the domain " +
                                                to_text(box.min) + " to " + to_text(box.max));
        }
        const Vec3 index = domain.world_to_index(seed);
        Coord voxel;
        for (int a = 0; a < 3; ++a)
            voxel[a] = std::clamp(int(std::floor(index[a] + 0.5)), domain.min[a], domain.max[a]);
        const float d = distance.tree().getValue(voxel);
        if (distance.tree().isValueOn(voxel) && !(double(d) > options.tag_distance)) {
            std::ostringstream s;
            s << "exterior seed " << to_text(seed)
              << ": expected a position farther from the points than the tag distance, " << options.tag_distance
              << ", got one at a distance of " << d
              << "; move the seed to the middle of the cavity, or use a smaller `tag_distance`";
            throw Error(Errc::InvalidInput, s.str());
        }
        voxels.push_back(voxel);
    }
    return voxels;
}

/// The initial level set in voxels. Outside, d - D is the distance to the tagged surface. Inside, the distance has to
/// be computed, because d - D is also zero where a wall borders on a core.
LeafArray<float> initial_values(const Tube& tube, const Tagging& tagging, const LeafArray<float>& level,
                                const RunContext& run) {
    LeafArray<float> u = detail::signed_distance(tube.band, level, tube.inside_domain, tube.box, kWidth, run);
    tbb::parallel_for(std::size_t(0), tube.band.size(), [&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at)
            if (detail::is_on(tagging.exterior.leaves[leaf], at))
                u.leaf(leaf)[at] = std::min(level.leaf(leaf)[at], kWidth);
    });
    return u;
}

BandResult make(const FloatGrid& distance, const BandOptions& options, const RunContext& run) {
    const Tube tube(distance);
    const double h = tube.domain.voxel_size, tag_distance = options.tag_distance;
    // Tolerance for the rounding of the tube's values to float.
    if (double(distance.background()) < (tag_distance + kHalfWidthVoxels * h) * (1 - 1e-6)) {
        std::ostringstream s;
        s << "expected a distance tube of at least D + 3 h = " << tag_distance + kHalfWidthVoxels * h << ", got "
          << distance.background();
        throw Error(Errc::InvalidInput, s.str());
    }
    const std::vector<Coord> seeds = seed_voxels(distance, tube.domain, options);
    run.check();
    const Tagging tagging = detail::tag(tube, float(tag_distance), seeds);
    const LeafArray<float> level = detail::signed_level(tube, tagging);
    const LeafArray<float> u = initial_values(tube, tagging, level, run);
    run.check();

    BandResult result;
    std::vector<LeafMask> active = tube.near(float(tag_distance + kHalfWidthVoxels * h));
    for (std::size_t leaf = 0; leaf < tube.band.size(); ++leaf) {
        for (int at = 0; at < kLeafSize; ++at)
            if (std::abs(u.leaf(leaf)[at]) < kWidth) detail::set_on(active[leaf], at);
        for (int word = 0; word < 8; ++word) active[leaf][word] &= tube.inside_domain[leaf][word];
        result.report.active_voxels += detail::count_on(active[leaf]);
    }
    std::vector<bool> interior(tube.columns.pieces().size());
    for (std::size_t n = 0; n < interior.size(); ++n)
        interior[n] = tube.columns.pieces()[n].leaf < 0 && !tagging.exterior.pieces[n];
    result.grid = detail::make_band(tube.band, tube.columns, u, active, interior, tube.domain, kWidth);
    result.report.tag_distance = tag_distance;
    result.report.enclosed_volume = double(tagging.enclosed) * h * h * h;
    result.report.core_volume = double(tagging.core) * h * h * h;
    test_for_leaks(tube, tagging, distance.background(), seeds, run, result.report);
    return result;
}

}  // namespace

std::string BandReport::leak() const {
    return "the points leave gaps wider than the tag distance " + detail::number(tag_distance) +
           (holding_distance > 0 ? "; a tag distance of " + detail::number(holding_distance) + " would close them"
                                 : "; no tag distance that closes them was found");
}

BandResult tag_interior(const FloatGrid& distance, const BandOptions& options, const RunContext& run) {
    require_valid(options, "tag_interior");
    if (distance.tree().leafCount() == 0)
        throw Error(Errc::InvalidInput,
                    "expected a distance grid with active voxels, got none: no point lies near the domain; check the "
                    "coordinates of the points and `roi`");
    BandResult result;
    with_threads(run, [&] { result = make(distance, options, run); });
    return result;
}

}  // namespace covol
