// Tagging: what a flood from outside cannot reach through {d > D} is inside ("3D image segmentation supported by a point
// cloud", section 3). The flood takes blocks without a leaf as a whole and works on 512-bit masks in the leaves.
#include "covol/band.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "covol/error.h"
#include "detail/leaf_columns.h"
#include "detail/signed_distance.h"

namespace covol {
namespace {

using detail::Coord;
using detail::kLeafSize;
using detail::LeafMask;

constexpr auto kWidth = float(kHalfWidthVoxels);
constexpr double kSignificantShare = 0.1;   ///< of the enclosed volume: a core that is less, grown by D, is a pocket
constexpr double kSignificantRadius = 0.25;  ///< of D: a core that is thinner is a pocket

/// The tube of a distance grid, flooded for any number of D.
class Tube {
public:
    explicit Tube(const FloatGrid& distance)
        : domain(domain_of(distance)),
          box(detail::box_of(domain)),
          band(distance),
          columns(band, box),
          d(band.size(), 0.0F),
          inside_domain(band.size()) {
        detail::import_values(distance, band, d);
        tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
            inside_domain[leaf] = detail::mask_in_box(band.origin(leaf), box);
        });
    }

    /// Voxels of the tube with d <= limit.
    [[nodiscard]] std::vector<LeafMask> near(float limit) const {
        std::vector<LeafMask> masks(band.size(), LeafMask{});
        tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
            for (int at = 0; at < kLeafSize; ++at)
                masks[leaf][at >> 6] |= std::uint64_t(d.leaf(leaf)[at] <= limit) << (at & 63);
            for (int word = 0; word < 8; ++word) masks[leaf][word] &= band.active(leaf)[word];
        });
        return masks;
    }

    const Domain domain;
    const detail::VoxelBox box;
    const detail::LeafBand band;
    const detail::LeafColumns columns;
    detail::LeafArray<float> d;
    std::vector<LeafMask> inside_domain;
};

/// What is outside at one D, and what is enclosed.
struct Tagging {
    std::vector<LeafMask> open;  ///< d > D, in the domain
    detail::Flood exterior;
    std::int64_t enclosed = 0;  ///< voxels that the flood did not reach
    std::int64_t core = 0;      ///< those of them with d > D
};

std::int64_t voxels_of_run(const Tube& tube, std::size_t piece) {
    const auto& run = tube.columns.pieces()[piece];
    return std::int64_t(run.end - run.begin) * kLeafSize;
}

Tagging tag(const Tube& tube, float tag_distance, const std::vector<Coord>& seeds) {
    Tagging result;
    result.open = tube.near(tag_distance);
    for (std::size_t leaf = 0; leaf < tube.band.size(); ++leaf)
        for (int word = 0; word < 8; ++word)
            result.open[leaf][word] = tube.inside_domain[leaf][word] & ~result.open[leaf][word];
    result.exterior = detail::flood(tube.columns, tube.band, result.open, tube.box, seeds);
    for (std::size_t leaf = 0; leaf < tube.band.size(); ++leaf)
        for (int word = 0; word < 8; ++word) {
            const std::uint64_t exterior = result.exterior.leaves[leaf][word];
            result.enclosed += __builtin_popcountll(tube.inside_domain[leaf][word] & ~exterior);
            result.core += __builtin_popcountll(result.open[leaf][word] & ~exterior);
        }
    // A run that the flood did not reach does not touch the domain's boundary, so all of its voxels count.
    for (std::size_t n = 0; n < tube.columns.pieces().size(); ++n) {
        if (tube.columns.pieces()[n].leaf >= 0 || result.exterior.pieces[n]) continue;
        result.enclosed += voxels_of_run(tube, n);
        result.core += voxels_of_run(tube, n);
    }
    return result;
}

/// Voxels of the cores of `larger` (tagged with a larger D) that were still exterior in `smaller`.
std::int64_t newly_enclosed(const Tube& tube, const Tagging& smaller, const Tagging& larger) {
    std::int64_t n = 0;
    for (std::size_t leaf = 0; leaf < tube.band.size(); ++leaf)
        for (int word = 0; word < 8; ++word)
            n += __builtin_popcountll(smaller.exterior.leaves[leaf][word] & larger.open[leaf][word] &
                                      ~larger.exterior.leaves[leaf][word]);
    for (std::size_t piece = 0; piece < tube.columns.pieces().size(); ++piece)
        if (smaller.exterior.pieces[piece] && !larger.exterior.pieces[piece]) n += voxels_of_run(tube, piece);
    return n;
}

/// A core appears where the last gap around it closes: one that appears just above D leaks at D.
void test_for_leaks(const Tube& tube, const Tagging& at_d, double tag_distance, double limit,
                    const std::vector<Coord>& seeds, BandReport& report) {
    const double h = tube.domain.voxel_size;
    const auto opens_up = [&](double larger) {
        const Tagging there = tag(tube, float(larger), seeds);
        // As if it were one ball: the core's radius, and its volume without the wall of thickness D.
        const double core_radius = std::cbrt(double(newly_enclosed(tube, at_d, there)) * 3.0 / (4.0 * std::numbers::pi)) * h;
        const double grown = 4.0 / 3.0 * std::numbers::pi * std::pow((core_radius + larger) / h, 3);
        return core_radius > kSignificantRadius * larger && grown > kSignificantShare * double(there.enclosed);
    };
    if (at_d.core > 0) {
        report.leaks = opens_up(tag_distance + h);
    } else {
        // Nothing left inside: a thin body whose core a smaller D still finds is solid, not leaking.
        const auto is_closed_at = [&](double share) { return tag(tube, float(share * tag_distance), seeds).core > 0; };
        report.leaks = !is_closed_at(0.85) && !is_closed_at(0.7) && !is_closed_at(0.55);
    }
    if (!report.leaks) return;
    for (double larger = tag_distance + 0.5 * h; larger <= limit && report.holding_distance == 0; larger += 0.5 * h)
        if (opens_up(larger)) report.holding_distance = larger;
}

std::string to_text(const Vec3& p) {
    std::ostringstream s;
    s << "(" << p[0] << ", " << p[1] << ", " << p[2] << ")";
    return s.str();
}

std::vector<Coord> seed_voxels(const FloatGrid& distance, const Domain& domain, const BandOptions& options) {
    std::vector<Coord> voxels;
    for (const Vec3& seed : options.exterior_seeds) {
        if (!domain.contains(seed)) {
            const WorldBox box = domain.world_box();
            throw Error(Errc::InvalidInput, "band: exterior seed " + to_text(seed) + ": expected a position in the domain " +
                                                to_text(box.min) + " to " + to_text(box.max));
        }
        const Vec3 index = domain.world_to_index(seed);
        Coord voxel;
        for (int a = 0; a < 3; ++a)
            voxel[a] = std::clamp(int(std::floor(index[a] + 0.5)), domain.min[a], domain.max[a]);
        const float d = distance.tree().getValue(voxel);
        if (distance.tree().isValueOn(voxel) && !(double(d) > options.tag_distance)) {
            std::ostringstream s;
            s << "band: exterior seed " << to_text(seed) << ": expected further from the points than the tag distance D = "
              << options.tag_distance << ", got d = " << d
              << "; move the seed to the middle of the cavity, or use a smaller tag distance";
            throw Error(Errc::InvalidInput, s.str());
        }
        voxels.push_back(voxel);
    }
    return voxels;
}

/// Negative where the flood did not come; beside the tagged surface d - D says where it lies.
detail::LeafArray<float> signed_level(const Tube& tube, const Tagging& tagging, float tag_distance) {
    detail::LeafArray<float> phi(tube.band.size(), 0.0F);
    const auto h = float(tube.domain.voxel_size);
    tbb::parallel_for(std::size_t(0), tube.band.size(), [&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at) {
            const float level = (tube.d.leaf(leaf)[at] - tag_distance) / h;
            phi.leaf(leaf)[at] = detail::is_on(tagging.exterior.leaves[leaf], at)
                                     ? std::max(level, 0.0F)
                                     : -std::max(std::abs(level), 1e-6F);
        }
    });
    return phi;
}

/// u0 in voxels. On the exterior's side d - D is the distance to the tagged surface; inside it has to be measured, since
/// there the other side of a wall, and the cores, have the same d.
detail::LeafArray<float> initial_values(const Tube& tube, const Tagging& tagging, float tag_distance,
                                        const RunContext& run) {
    const detail::LeafArray<float> phi = signed_level(tube, tagging, tag_distance);
    detail::LeafArray<float> u =
        detail::signed_distance(tube.band, phi, tube.inside_domain, tube.box, kWidth, run);
    tbb::parallel_for(std::size_t(0), tube.band.size(), [&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at)
            if (detail::is_on(tagging.exterior.leaves[leaf], at))
                u.leaf(leaf)[at] = std::min(phi.leaf(leaf)[at], kWidth);
    });
    return u;
}

BandResult make(const FloatGrid& distance, const BandOptions& options, const RunContext& run) {
    const Tube tube(distance);
    const double h = tube.domain.voxel_size, tag_distance = options.tag_distance;
    // The tube's own values were rounded to float: allow for that.
    if (double(distance.background()) < (tag_distance + kHalfWidthVoxels * h) * (1 - 1e-6)) {
        std::ostringstream s;
        s << "band: expected a distance tube of at least D + 3 h = " << tag_distance + kHalfWidthVoxels * h << ", got "
          << distance.background();
        throw Error(Errc::InvalidInput, s.str());
    }
    const std::vector<Coord> seeds = seed_voxels(distance, tube.domain, options);
    run.check();
    const Tagging tagging = tag(tube, float(tag_distance), seeds);
    const detail::LeafArray<float> u = initial_values(tube, tagging, float(tag_distance), run);
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
    test_for_leaks(tube, tagging, tag_distance, distance.background(), seeds, result.report);
    return result;
}

}  // namespace

std::string BandOptions::why_invalid() const {
    if (tag_distance > 0 && std::isfinite(tag_distance)) return {};
    return "tag_distance: expected > 0, got " + std::to_string(tag_distance) + "\n";
}

BandResult band(const FloatGrid& distance, const BandOptions& options, const RunContext& run) {
    if (const std::string why = options.why_invalid(); !why.empty())
        throw Error(Errc::InvalidOptions, "band: " + why);
    if (distance.tree().leafCount() == 0)
        throw Error(Errc::InvalidInput, "band: expected a distance grid with active voxels, got none: no point lies near the domain");
    BandResult result;
    with_threads(run, [&] { result = make(distance, options, run); });
    return result;
}

}  // namespace covol
