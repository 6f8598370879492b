#include "evolve/tracking.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/large_allocator.h"
#include "covol/error.h"
#include "grid/halo.h"
#include "redistance/local_distance.h"

namespace covol::detail {

namespace {

using LeafNode = FloatGrid::TreeType::LeafNodeType;
constexpr float kWidth = float(kTrackingWidth);

/// The leaves with a voxel edge that the zero level set cuts.
std::vector<Coord> crossed_leaves(const FloatGrid& u) {
    const LeafBand band(u);
    const HaloField values = gather(band, u, false, [](const LeafNode* leaf, float tile, float* block) {
        for (int n = 0; n < kLeafSize; ++n) block[n] = leaf != nullptr ? leaf->getValue(n) : tile;
    });
    std::vector<unsigned char> is_crossed(band.size());
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        alignas(64) float padded[kPaddedSize], cuts[LocalDistance::kCuts];
        load_star(values, leaf, padded);
        kernels().cut_edges(padded, cuts);
        is_crossed[leaf] = *std::max_element(cuts, cuts + LocalDistance::kCuts) > 0;
    });
    std::vector<Coord> crossed;
    for (std::size_t leaf = 0; leaf < band.size(); ++leaf)
        if (is_crossed[leaf]) crossed.push_back(band.origin(leaf));
    return crossed;
}

}  // namespace

std::vector<Coord> track_surface_near(const std::vector<Coord>& stale, FloatGrid& u, const Domain& domain,
                                      double clamp) {
    const auto limit = static_cast<float>(clamp), h = static_cast<float>(domain.voxel_size);
    // One more ring for what the leaves beyond say.
    std::vector<Coord> changed = dilate_leaves(stale, 1, domain);
    const LeafBand region(dilate_leaves(stale, 2, domain));
    std::vector<unsigned char> zone(region.size());
    std::vector<std::uint32_t> place(region.size());
    std::uint32_t zone_size = 0;
    for (std::size_t leaf = 0; leaf < region.size(); ++leaf) {
        zone[leaf] = std::binary_search(changed.begin(), changed.end(), region.origin(leaf));
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

    std::vector<LeafNode*> nodes(region.size(), nullptr);
    auto& tree = u.tree();
    for (std::size_t leaf = 0; leaf < region.size(); ++leaf) {
        if (!zone[leaf]) continue;
        const float* d = local.distance(leaf);
        const float outside = values.values.leaf(leaf)[0] < 0.0F ? -u.background() : u.background();
        if (*std::min_element(d, d + kLeafSize) < kWidth)
            nodes[leaf] = tree.touchLeaf(region.origin(leaf));
        else if (tree.probeConstLeaf(region.origin(leaf)) != nullptr)
            tree.addTile(1, region.origin(leaf), outside, false);
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
    return changed;
}

void track_surface(FloatGrid& u, const Domain& domain, double clamp) {
    const auto limit = static_cast<float>(clamp * domain.voxel_size);
    const std::vector<Coord> crossed = crossed_leaves(u), near = dilate_leaves(crossed, 1, domain);
    const FloatGridPtr next = u.deepCopy();
    auto& tree = next->tree();
    std::vector<std::pair<Coord, float>> far;
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
        if (!std::binary_search(near.begin(), near.end(), leaf->origin()))
            far.emplace_back(leaf->origin(), leaf->getFirstValue());
    for (const auto& [origin, value] : far) tree.addTile(1, origin, value, false);
    auto tile = tree.beginValueAll();
    tile.setMaxDepth(FloatGrid::TreeType::ValueAllIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) tile.setValue(std::copysign(limit, *tile));
    tree.root().setBackground(limit, false);
    track_surface_near(crossed, *next, domain, clamp);
    if (tree.leafCount() == 0)
        throw Error(Errc::InvalidInput,
                    "evolve: grid '" + u.getName() +
                        "' has no zero crossing: nothing in the domain is inside, or nothing outside");
    u.setTree(next->treePtr());
}

}  // namespace covol::detail
