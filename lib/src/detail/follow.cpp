#include "detail/follow.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "detail/halo.h"
#include "detail/redistance.h"

namespace covol::detail {

namespace {

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
