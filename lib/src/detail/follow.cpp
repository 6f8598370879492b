#include "detail/follow.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "detail/halo.h"
#include "detail/redistance.h"
#include "detail/scheme.h"

namespace covol::detail {

namespace {

using LeafNode = FloatGrid::TreeType::LeafNodeType;
constexpr float kWidth = float(kFollowWidth);
constexpr float kFallTolerance = 1e-3F;  // voxels

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

/// Distances to the zero level set on some leaves of a grid; the leaves around them stay as they are.
class LocalDistance {
public:
    /// Values in voxels; a leaf that the grid lacks has its tile's.
    /// Values at or beyond `clamp` say nothing of distances.
    LocalDistance(const FloatGrid& u, const LeafBand& region, const Domain& domain, float clamp) : region_(region) {
        const auto scale = static_cast<float>(1.0 / domain.voxel_size);
        u_ = gather(region, u, false, [scale](const LeafNode* leaf, float tile, float* block) {
            for (int n = 0; n < kLeafSize; ++n) block[n] = scale * (leaf != nullptr ? leaf->getValue(n) : tile);
        });
        distance_ = u_;
        const std::size_t blocks = distance_.values.blocks();
        tbb::parallel_for(std::size_t(0), blocks, [&](std::size_t block) {
            float* d = distance_.values.leaf(block);
            const bool known = block >= region_.size();
            for (int n = 0; n < kLeafSize; ++n)
                d[n] = known && std::abs(d[n]) < kUnclamped * clamp ? std::abs(d[n]) : kWidth;
        });
        cuts_ = LeafArray<float>(3 * region.size(), 0.0F, 0);
        tbb::parallel_for(std::size_t(0), region.size(), [&](std::size_t leaf) { find_cuts(leaf, LeafBounds(domain, region_.origin(leaf))); });
    }

    /// Leaves in two colours; one is visited again when a leaf across a face has changed since.
    void spread() {
        const SchemeKernels& kernel = kernels();
        std::vector<unsigned char> changed(region_.size() + 1, 0);
        bool first = true;
        for (std::atomic<bool> again = true; again; first = false) {
            again = false;
            const std::size_t begins[3] = {0, region_.odd_begin(), region_.size()};
            for (int colour = 0; colour < 2; ++colour)
                tbb::parallel_for(begins[colour], begins[colour + 1], [&](std::size_t leaf) {
                    unsigned char news = first ? 1 : 0;
                    for (const int slot : {4, 10, 12, 14, 16, 22}) news |= changed[region_.neighbours(leaf)[slot]];
                    changed[leaf] = 0;
                    if (!news) return;
                    alignas(64) float d[kPaddedSize];
                    load_star(distance_, leaf, d);
                    if (!kernel.eikonal(d, cuts_.leaf(3 * leaf), kFallTolerance)) return;
                    store_inner(d, distance_.values.leaf(leaf));
                    changed[leaf] = 1;
                    again = true;
                });
        }
    }

    [[nodiscard]] const float* distance(std::size_t leaf) const { return distance_.values.leaf(leaf); }
    [[nodiscard]] bool is_inside(std::size_t leaf, int n) const { return u_.values.leaf(leaf)[n] < 0.0F; }

    /// The distances of a leaf, where next to the surface u is but scaled: by one factor for a voxel and those across the edges
    /// that the surface cuts, so that it hardly moves (D. Hartmann, M. Meinke, W. Schröder 2010, the scheme CR-1).
    void settled(std::size_t leaf, float* out) const {
        alignas(64) float d[kPaddedSize], u[kPaddedSize];
        load_star(distance_, leaf, d);
        load_star(u_, leaf, u);
        const float* cut = cuts_.leaf(3 * leaf);
        for (int n = 0; n < kLeafSize; ++n) {
            const int p = padded(n >> 6, n >> 3 & 7, n & 7);
            out[n] = d[p];
            float distances = d[p], values = std::abs(u[p]);
            bool is_cut = false;
            for (int axis = 0; axis < 3; ++axis) {
                if (cut[axis * kLeafSize + n] == 0.0F) continue;
                for (const int q : {p - kStride[axis], p + kStride[axis]}) {
                    if ((u[q] < 0.0F) == (u[p] < 0.0F)) continue;
                    is_cut = true;
                    distances += d[q];
                    values += std::abs(u[q]);
                }
            }
            if (is_cut && values > 0.0F) out[n] = std::abs(u[p]) * distances / values;
        }
    }

private:
    void find_cuts(std::size_t leaf, const LeafBounds& bounds) {
        alignas(64) float u[kPaddedSize];
        load_star(u_, leaf, u);
        // Beyond the domain there is no surface.
        if (bounds.cuts()) mirror_outside(u, bounds.lo, bounds.hi);
        float* cut = cuts_.leaf(3 * leaf);
        for (int n = 0; n < kLeafSize; ++n) {
            const float* p = u + padded(n >> 6, n >> 3 & 7, n & 7);
            for (int axis = 0; axis < 3; ++axis)
                for (const float q : {p[-kStride[axis]], p[kStride[axis]]}) {
                    if ((q < 0.0F) == (*p < 0.0F)) continue;
                    const float along = std::max(std::abs(*p) / (std::abs(*p) + std::abs(q)), kLeastCut);
                    cut[axis * kLeafSize + n] = std::max(cut[axis * kLeafSize + n], 1.0F / along);
                }
        }
    }

    static constexpr float kLeastCut = 1e-4F;    ///< voxels
    static constexpr float kUnclamped = 0.99F;
    static constexpr int kStride[3] = {padded(1, 0, 0) - padded(0, 0, 0), padded(0, 1, 0) - padded(0, 0, 0), 1};
    const LeafBand& region_;
    HaloField u_, distance_;
    LeafArray<float> cuts_;
};

}  // namespace

std::vector<Coord> follow_surface_near(const std::vector<Coord>& stale, FloatGrid& u, const Domain& domain, double clamp) {
    LeafBand region(dilate_leaves(stale, 1, domain));
    const auto limit = static_cast<float>(clamp), h = static_cast<float>(domain.voxel_size);
    LocalDistance local(u, region, domain, limit);
    local.spread();

    std::vector<Coord> changed(region.size());
    std::vector<LeafNode*> nodes(region.size(), nullptr);
    auto& tree = u.tree();
    for (std::size_t leaf = 0; leaf < region.size(); ++leaf) {
        changed[leaf] = region.origin(leaf);
        const float* d = local.distance(leaf);
        if (*std::min_element(d, d + kLeafSize) < kWidth)
            nodes[leaf] = tree.touchLeaf(region.origin(leaf));
        else if (tree.probeConstLeaf(region.origin(leaf)) != nullptr)
            tree.addTile(1, region.origin(leaf), local.is_inside(leaf, 0) ? -u.background() : u.background(), false);
    }
    tbb::parallel_for(std::size_t(0), region.size(), [&](std::size_t leaf) {
        if (nodes[leaf] == nullptr) return;
        float d[kLeafSize];
        local.settled(leaf, d);
        const LeafBounds bounds(domain, region.origin(leaf));
        for (int n = 0; n < kLeafSize; ++n) {
            const float value = h * std::min(d[n], limit);
            const bool on = d[n] < kWidth && bounds.contains(n >> 6, n >> 3 & 7, n & 7);
            nodes[leaf]->setValueOnly(n, local.is_inside(leaf, n) ? -value : value);
            nodes[leaf]->setActiveState(n, on);
        }
    });
    std::sort(changed.begin(), changed.end());
    return changed;
}

void follow_surface(FloatGrid& u, const Domain& domain, double clamp, const RunContext& run) {
    const FloatGridPtr next = redistance(u, domain, kFollowWidth, DomainEnd::Open, u.getName().c_str(), run);
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
