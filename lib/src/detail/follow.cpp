#include "detail/follow.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include "detail/halo.h"
#include "detail/redistance.h"

namespace covol::detail {

void follow_surface(FloatGrid& u, const Domain& domain, const RunContext& run) {
    const FloatGridPtr next = redistance(u, domain, kFollowWidth, DomainEnd::Open, u.getName().c_str(), run);
    const LeafBand band(*next);
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        const LeafBounds bounds(domain, band.origin(leaf));
        if (!bounds.cuts()) return;
        auto* node = next->tree().probeLeaf(band.origin(leaf));
        for (int n = 0; n < kLeafSize; ++n)
            if (!bounds.contains(n >> 6, n >> 3 & 7, n & 7)) node->setValueOff(n);
    });
    u.setTree(next->treePtr());
}

}  // namespace covol::detail
