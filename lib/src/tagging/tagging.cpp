#include "tagging/tagging.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/heuristics.h"

namespace covol::detail {
namespace {

/// Whether a core is a structure and not a pocket: its radius is not small compared to the tag distance, and its
/// volume, after dilation by the tag distance, is not negligible compared to the enclosed volume.
/// @param core, enclosed  volumes, voxels
/// @param distance        voxels
bool is_structure(double core, double enclosed, double distance) {
    constexpr double kBall = 4.0 / 3.0 * std::numbers::pi;
    const double radius = std::cbrt(core / kBall);
    return radius > kCommon.minority * distance &&
           kBall * std::pow(radius + distance, 3) > kCommon.negligible * enclosed;
}

std::int64_t voxels_of(const LeafColumns::Piece& run) { return std::int64_t(run.end - run.begin) * kLeafSize; }

}  // namespace

Tube::Tube(const FloatGrid& distance)
    : domain(domain_of(distance)),
      box(box_of(domain)),
      band(distance),
      columns(band, box),
      d(band.size(), 0.0F),
      inside_domain(band.size()) {
    import_values(distance, band, d);
    tbb::parallel_for(std::size_t(0), band.size(),
                      [&](std::size_t leaf) { inside_domain[leaf] = mask_in_box(band.origin(leaf), box); });
}

std::vector<LeafMask> Tube::near(float limit) const {
    std::vector<LeafMask> masks(band.size(), LeafMask{});
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at)
            masks[leaf][at >> 6] |= std::uint64_t(d.leaf(leaf)[at] <= limit) << (at & 63);
        for (int word = 0; word < 8; ++word) masks[leaf][word] &= band.active(leaf)[word];
    });
    return masks;
}

bool Tagging::has_core(double voxel_size) const {
    return is_structure(double(core), double(enclosed), distance / voxel_size);
}

Tagging tag(const Tube& tube, float tag_distance, const std::vector<Coord>& seeds) {
    Tagging result;
    result.distance = tag_distance;
    result.open = tube.near(tag_distance);
    for (std::size_t leaf = 0; leaf < tube.band.size(); ++leaf)
        for (int word = 0; word < 8; ++word)
            result.open[leaf][word] = tube.inside_domain[leaf][word] & ~result.open[leaf][word];
    result.exterior = flood(tube.columns, tube.band, result.open, tube.box, seeds);
    for (std::size_t leaf = 0; leaf < tube.band.size(); ++leaf)
        for (int word = 0; word < 8; ++word) {
            const std::uint64_t exterior = result.exterior.leaves[leaf][word];
            result.enclosed += __builtin_popcountll(tube.inside_domain[leaf][word] & ~exterior);
            result.core += __builtin_popcountll(result.open[leaf][word] & ~exterior);
        }
    // A run that the flood did not reach does not touch the domain's boundary, so that all its voxels lie in the domain
    // and count.
    const auto& pieces = tube.columns.pieces();
    for (std::size_t n = 0; n < pieces.size(); ++n) {
        if (pieces[n].leaf >= 0 || result.exterior.pieces[n]) continue;
        result.enclosed += voxels_of(pieces[n]);
        result.core += voxels_of(pieces[n]);
    }
    return result;
}

bool closes_a_core(const Tube& tube, const Tagging& smaller, const Tagging& larger) {
    std::int64_t core = 0;
    for (std::size_t leaf = 0; leaf < tube.band.size(); ++leaf)
        for (int word = 0; word < 8; ++word)
            core += __builtin_popcountll(smaller.exterior.leaves[leaf][word] & larger.open[leaf][word] &
                                         ~larger.exterior.leaves[leaf][word]);
    const auto& pieces = tube.columns.pieces();
    for (std::size_t n = 0; n < pieces.size(); ++n)
        if (smaller.exterior.pieces[n] && !larger.exterior.pieces[n]) core += voxels_of(pieces[n]);
    return is_structure(double(core), double(larger.enclosed), larger.distance / tube.domain.voxel_size);
}

LeafArray<float> signed_level(const Tube& tube, const Tagging& tagging) {
    LeafArray<float> phi(tube.band.size(), 0.0F);
    const auto h = float(tube.domain.voxel_size);
    tbb::parallel_for(std::size_t(0), tube.band.size(), [&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at) {
            const float level = (tube.d.leaf(leaf)[at] - tagging.distance) / h;
            phi.leaf(leaf)[at] =
                is_on(tagging.exterior.leaves[leaf], at) ? std::max(level, 0.0F) : -std::max(std::abs(level), 1e-6F);
        }
    });
    return phi;
}

}  // namespace covol::detail
