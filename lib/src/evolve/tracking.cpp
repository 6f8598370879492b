#include "evolve/tracking.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "base/large_allocator.h"
#include "grid/halo.h"
#include "redistance/local_distance.h"
#include "redistance/redistance.h"

namespace covol::detail {

namespace {

using LeafNode = FloatGrid::TreeType::LeafNodeType;
constexpr float kWidth = float(kTrackingWidth);

void clamp_values(FloatGrid::TreeType& tree, const LeafBand& band, float limit) {
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        float* values = tree.probeLeaf(band.origin(leaf))->buffer().data();
        for (int n = 0; n < kLeafSize; ++n) values[n] = std::clamp(values[n], -limit, limit);
    });
    auto tile = tree.beginValueAll();
    tile.setMaxDepth(FloatGrid::TreeType::ValueAllIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) tile.setValue(std::clamp(*tile, -limit, limit));
    tree.root().setBackground(limit, false);
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

void track_surface(FloatGrid& u, const Domain& domain, double clamp, const RunContext& run) {
    const FloatGridPtr next = redistance(u, domain, kTrackingWidth, DomainEnd::Open, u.getName().c_str(), run);
    const LeafBand band(*next);
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        const LeafBounds bounds(domain, band.origin(leaf));
        if (!bounds.cuts()) return;
        auto* node = next->tree().probeLeaf(band.origin(leaf));
        for (int n = 0; n < kLeafSize; ++n)
            if (!bounds.contains(n >> 6, n >> 3 & 7, n & 7)) node->setValueOff(n);
    });
    clamp_values(next->tree(), band, static_cast<float>(clamp * domain.voxel_size));
    u.setTree(next->treePtr());
}

}  // namespace covol::detail
