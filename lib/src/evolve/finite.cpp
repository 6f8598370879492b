#include "evolve/finite.h"

#include <openvdb/openvdb.h>
#include <openvdb/tree/LeafManager.h>

#include <atomic>
#include <cmath>
#include <sstream>

namespace covol::detail {

Error not_finite(const char* what, float value, const openvdb::Coord& at) {
    std::ostringstream text;
    text << "evolve: " << what << ": expected finite values, got " << value << " at voxel (" << at.x() << ", " << at.y()
         << ", " << at.z() << ")";
    return {Errc::InvalidInput, text.str()};
}

void expect_finite(const FloatGrid& grid, const char* what) {
    openvdb::tree::LeafManager<const openvdb::FloatTree> leaves(grid.tree());
    std::atomic<std::size_t> first = leaves.leafCount();
    leaves.foreach ([&](const auto& leaf, std::size_t n) {
        for (auto value = leaf.cbeginValueOn(); value; ++value)
            if (!std::isfinite(*value))
                for (std::size_t before = first; n < before && !first.compare_exchange_weak(before, n);) continue;
    });
    if (first == leaves.leafCount()) return;
    for (auto value = leaves.leaf(first).cbeginValueOn(); value; ++value)
        if (!std::isfinite(*value)) throw not_finite(what, *value, value.getCoord());
}

}  // namespace covol::detail
