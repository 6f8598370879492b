#include "guidance/wide_distance.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/ChangeBackground.h>
#include <tbb/parallel_for.h>

#include <cmath>

namespace covol::guidance {
namespace {

using Leaf = FloatGrid::TreeType::LeafNodeType;

std::vector<Vec3> to_index(const Domain& domain, const std::vector<Vec3>& world) {
    std::vector<Vec3> index;
    index.reserve(world.size());
    for (const Vec3& x : world) index.push_back(domain.world_to_index(x));
    return index;
}

/// The leaves of `grid` at the positions of the leaves of `nearest`, in the same order; missing ones are created.
std::vector<Leaf*> touched(FloatGrid& grid, const detail::NearestField& nearest) {
    std::vector<Leaf*> leaves;
    for (const detail::NearestLeaf& leaf : nearest.leaves) leaves.push_back(grid.tree().touchLeaf(leaf.origin));
    return leaves;
}

}  // namespace

WideDistance::WideDistance(const FloatGrid& start, const std::vector<Vec3>& vertices, const Domain& domain,
                           double width, const RunContext& run)
    : nearest_(
          detail::nearest_points(to_index(domain, vertices), detail::box_of(domain), width, "image guidance", run)),
      grid_(start.deepCopy()) {
    const double h = domain.voxel_size;
    // In the outermost voxel of the start's band, the distance is affected by the clamping, and is therefore not used.
    const auto own = float((kHalfWidthVoxels - 1) * h), far = float(width * h);
    openvdb::tools::changeLevelSetBackground(grid_->tree(), far);
    const std::vector<Leaf*> leaves = touched(*grid_, nearest_);
    const detail::CoordBBox box = detail::box_of(domain);
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
        alignas(32) float squared[detail::kLeafSize];
        detail::squared_distances(nearest_, nearest_.leaves[n], squared);
        const detail::LeafMask in_domain = detail::mask_in_box(nearest_.leaves[n].origin, box);
        float* values = leaves[n]->buffer().data();
        for (int at = 0; at < detail::kLeafSize; ++at) {
            if (!detail::is_on(in_domain, at)) continue;
            const auto d = float(h) * std::sqrt(squared[at]);
            if (!(d < far)) continue;
            if (std::abs(values[at]) > own) values[at] = std::copysign(d, values[at]);
            leaves[n]->setValueOn(openvdb::Index(at));
        }
    });
}

FloatGridPtr WideDistance::less(const std::vector<double>& by_vertex) const {
    FloatGridPtr result = grid_->deepCopy();
    const std::vector<Leaf*> leaves = touched(*result, nearest_);
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
        const detail::NearestLeaf& leaf = nearest_.leaves[n];
        float* values = leaves[n]->buffer().data();
        for (auto value = leaves[n]->cbeginValueOn(); value; ++value) {
            const std::int32_t nearest = leaf.nearest[value.pos()];
            if (nearest >= 0)
                values[value.pos()] -= float(by_vertex[std::size_t(nearest_.source[std::size_t(nearest)])]);
        }
    });
    return result;
}

}  // namespace covol::guidance
