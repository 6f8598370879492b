#include "redistance/tracking.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/large_allocator.h"
#include "covol/error.h"
#include "grid/halo.h"
#include "grid/leaf_propagation.h"
#include "grid/sign_masks.h"
#include "redistance/local_distance.h"
#include "redistance/no_surface.h"
#include "redistance/redistance.h"
#include "scheme/scheme.h"

namespace covol::detail {

namespace {

using LeafNode = FloatGrid::TreeType::LeafNodeType;
constexpr float kWidth = float(kTrackingWidth);

/// Clamps the values of leaves. Tiles, which are far from the surface, and the background get the limit and keep their
/// sign.
void clamp_values(FloatGrid::TreeType& tree, const LeafBand& band, float limit) {
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        float* values = tree.probeLeaf(band.origin(leaf))->buffer().data();
        for (int n = 0; n < kLeafSize; ++n) values[n] = std::clamp(values[n], -limit, limit);
    });
    auto tile = tree.beginValueAll();
    tile.setMaxDepth(FloatGrid::TreeType::ValueAllIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) tile.setValue(*tile < 0.0F ? -limit : limit);
    tree.root().setBackground(limit, false);
}

void remove_leaf(const Coord& origin, bool is_inside, FloatGrid& u) {
    if (u.tree().probeConstLeaf(origin) != nullptr)
        u.tree().addTile(1, origin, is_inside ? -u.background() : u.background(), false);
}

/// The leaves with a voxel edge, in the leaf or to the next leaf, that the surface crosses; sorted.
std::vector<Coord> crossed_leaves(const FloatGrid& u) {
    const LeafBand band(u);
    std::vector<LeafMask> negative(band.size());
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        negative[leaf] = negative_mask(u.tree().probeConstLeaf(band.origin(leaf))->buffer().data());
    });
    std::vector<char> crosses(band.size(), 0);
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        for (int face = 0; face < 6 && !crosses[leaf]; ++face) {
            LeafMask beyond;
            if (const std::int32_t next = band.neighbours(leaf)[kFaceSlots[face]]; next != band.none())
                beyond = negative[next];
            else
                beyond.fill(u.tree().getValue(neighbour_origin(band.origin(leaf), kFaceSlots[face])) < 0 ? ~0ULL : 0);
            crosses[leaf] = beside_marked(negative[leaf], beyond, face / 2, face % 2 == 0 ? -1 : 1) != negative[leaf];
        }
    });
    std::vector<Coord> result;
    for (std::size_t leaf = 0; leaf < band.size(); ++leaf)
        if (crosses[leaf]) result.push_back(band.origin(leaf));
    std::sort(result.begin(), result.end());
    return result;
}

/// Recomputes the distances on the leaves of a region that are in the zone. If the surface is near none of them, u is
/// not changed.
/// @return whether the surface is near one of them
bool recompute(const LeafBand& region, const std::vector<unsigned char>& zone, FloatGrid& u, const Domain& domain,
               double clamp) {
    const auto limit = static_cast<float>(clamp), h = static_cast<float>(domain.voxel_size);
    std::vector<std::uint32_t> place(region.size());
    std::uint32_t zone_size = 0;
    for (std::size_t leaf = 0; leaf < region.size(); ++leaf) {
        place[leaf] = zone_size;
        zone_size += zone[leaf];
    }
    const HaloField values = gather(region, u, false, [h](const LeafNode* leaf, float tile, float* block) {
        for (int n = 0; n < kLeafSize; ++n) block[n] = (leaf != nullptr ? leaf->getValue(n) : tile) / h;
    });
    std::vector<float, LargeAllocator<float>> cuts(zone_size * LocalDistance::kCuts),
        distances(region.size() * kLeafSize);
    LocalDistance local(region, values, zone, domain, limit, kWidth, {cuts.data(), distances.data(), place.data()});
    local.compute();
    std::vector<char> is_near(region.size());
    tbb::parallel_for(std::size_t(0), region.size(), [&](std::size_t leaf) {
        const float* d = local.distance(leaf);
        is_near[leaf] = zone[leaf] && *std::min_element(d, d + kLeafSize) < kWidth;
    });
    if (std::find(is_near.begin(), is_near.end(), 1) == is_near.end()) return false;

    std::vector<LeafNode*> nodes(region.size(), nullptr);
    auto& tree = u.tree();
    for (std::size_t leaf = 0; leaf < region.size(); ++leaf) {
        if (!zone[leaf]) continue;
        if (is_near[leaf])
            nodes[leaf] = tree.touchLeaf(region.origin(leaf));
        else
            remove_leaf(region.origin(leaf), values.values.leaf(leaf)[0] < 0.0F, u);
    }
    tbb::parallel_for(std::size_t(0), region.size(), [&](std::size_t leaf) {
        if (nodes[leaf] == nullptr) return;
        const float* before = values.values.leaf(leaf);
        const LeafBounds bounds(domain, region.origin(leaf));
        for (int n = 0; n < kLeafSize; ++n) {
            const float value = h * std::min(local.settled(leaf)[n], limit);
            nodes[leaf]->setValueOnly(n, before[n] < 0.0F ? -value : value);
            nodes[leaf]->setActiveState(n,
                                        local.distance(leaf)[n] < kWidth && bounds.contains(n >> 6, n >> 3 & 7, n & 7));
        }
    });
    return true;
}

/// Removes the leaves for which `is_removed` is true.
template <typename Condition>
void remove_leaves(Condition is_removed, FloatGrid& u) {
    std::vector<Coord> removed;
    for (auto leaf = u.tree().cbeginLeaf(); leaf; ++leaf)
        if (is_removed(*leaf)) removed.push_back(leaf->origin());
    for (const Coord& origin : removed) remove_leaf(origin, u.tree().getValue(origin) < 0, u);
}

constexpr float kNear = 1.5F;  // [voxels] near_distance() is used up to this distance

/// The distance of a voxel next to the front, to second order: |u| / |grad u|, in voxels. Infinity if u is not close to
/// a distance, or has a kink: upwind and central differences then disagree.
/// @param u  points to the voxel's value in a padded buffer
float near_distance(const float* u) {
    constexpr float kKink = 0.25F, kNone = std::numeric_limits<float>::infinity();
    if (!(std::abs(*u) < kNear * float(kSteepest))) return kNone;
    float central = 0, upwind = 0;
    for (const int stride : {10 * kRow, kRow, 1}) {
        const float low = u[-stride], high = u[stride];
        const float down = std::max({0.0F, *u < 0 ? low - *u : *u - low, *u < 0 ? high - *u : *u - high});
        upwind += down * down;
        central += 0.25F * (high - low) * (high - low);
    }
    central = std::sqrt(central);
    const bool is_distance = central > float(kFlattest) && central < float(kSteepest) &&
                             std::abs(std::sqrt(upwind) - central) < kKink * central;
    return is_distance ? std::abs(*u) / central : kNone;
}

}  // namespace

std::vector<Coord> track_surface_near(const std::vector<Coord>& stale, FloatGrid& u, const Domain& domain,
                                      double clamp) {
    // `region` is `changed` with one more ring of leaves. The values in this ring are only read.
    std::vector<Coord> changed = dilate_leaves(stale, 1, domain);
    const LeafBand region(dilate_leaves(stale, 2, domain));
    std::vector<unsigned char> zone(region.size());
    for (std::size_t leaf = 0; leaf < region.size(); ++leaf)
        zone[leaf] = std::binary_search(changed.begin(), changed.end(), region.origin(leaf));
    recompute(region, zone, u, domain, clamp);
    return changed;
}

void track_surface(FloatGrid& u, const Domain& domain, double clamp) {
    static_assert(kTrackingWidth < kLeafDim);
    const std::vector<Coord> near = dilate_leaves(crossed_leaves(u), 1, domain);
    if (!recompute(LeafBand(near), std::vector<unsigned char>(near.size(), 1), u, domain, clamp))
        throw NoSurface("grid '" + u.getName() +
                        "' has no zero crossing: nothing in the domain is inside, or nothing "
                        "outside");
    remove_leaves([&](const LeafNode& leaf) { return !std::binary_search(near.begin(), near.end(), leaf.origin()); },
                  u);
    clamp_values(u.tree(), LeafBand(u), static_cast<float>(clamp * domain.voxel_size));
}

void track_free_surface(FloatGrid& u, const Domain& domain, const RunContext& run) {
    // The stencil of the flow reads one voxel beyond the active band. The distance is therefore computed farther: a
    // constant value there would spread into the band by a voxel per step.
    constexpr double kReach = kFreeWidth + 0.9;
    static_assert(kReach < kLeafDim);
    const FloatGridPtr next = redistance(u, domain, kReach, DomainEnd::Open, u.getName().c_str(), run);
    const CoordBBox box = box_of(domain);
    remove_leaves([&](const LeafNode& leaf) { return !box.hasOverlap(leaf.getNodeBoundingBox()); }, *next);
    const LeafBand band(*next);
    const auto h = static_cast<float>(domain.voxel_size);
    const HaloField before = gather(band, u, false, [h](const LeafNode* leaf, float tile, float* block) {
        for (int n = 0; n < kLeafSize; ++n) block[n] = (leaf != nullptr ? leaf->getValue(n) : tile) / h;
    });
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        alignas(64) float values[kPaddedSize];
        load_star(before, leaf, values);
        const LeafBounds bounds(domain, band.origin(leaf));
        if (bounds.cuts()) mirror_outside(values, bounds.lo, bounds.hi);
        auto* node = next->tree().probeLeaf(band.origin(leaf));
        for (int n = 0; n < kLeafSize; ++n) {
            const float* at = values + padded(n >> 6, n >> 3 & 7, n & 7);
            if (const float d = near_distance(at); d < kNear)
                node->setValueOnly(n, std::copysign(h * d, *at));
            else if (!bounds.contains(n >> 6, n >> 3 & 7, n & 7) || std::abs(node->getValue(n)) >= kFreeWidth * h)
                node->setValueOff(n);
        }
    });
    u.setTree(next->treePtr());
}

}  // namespace covol::detail
