#include "covol/distance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "covol/error.h"
#include "distance/memory_need.h"
#include "distance/nearest.h"
#include "grid/leaf_band.h"

namespace covol {
namespace {

using Leaf = FloatGrid::TreeType::LeafNodeType;

std::vector<Vec3> to_index_space(const std::vector<Vec3>& points, const Domain& domain) {
    if (points.empty()) throw Error(Errc::InvalidInput, "points: expected at least one, got none");
    std::vector<Vec3> result(points.size());
    for (std::size_t n = 0; n < points.size(); ++n) {
        for (const double c : points[n])
            if (!std::isfinite(c))
                throw Error(Errc::InvalidInput, "point " + std::to_string(n) + ": expected finite numbers");
        result[n] = domain.world_to_index(points[n]);
    }
    return result;
}

/// The distances of a leaf's voxels; null if no voxel lies both in the tube and in the box.
std::unique_ptr<Leaf> make_leaf(const detail::NearestField& field, const detail::NearestLeaf& nearest,
                                const detail::CoordBBox& box, float h, float background) {
    alignas(32) float d[detail::kLeafSize];
    detail::squared_distances(field, nearest, d);
    detail::LeafMask active = detail::mask_in_box(nearest.origin, box);
    for (int at = 0; at < detail::kLeafSize; ++at) {
        d[at] = h * std::sqrt(d[at]);
        active[at >> 6] &= ~(std::uint64_t(!(d[at] <= background)) << (at & 63));
        if (!detail::is_on(active, at)) d[at] = background;
    }
    if (!detail::any_on(active)) return nullptr;
    auto leaf = std::make_unique<Leaf>(nearest.origin, background, false);
    std::copy_n(d, detail::kLeafSize, leaf->buffer().data());
    auto mask = leaf->valueMask();
    for (int word = 0; word < 8; ++word) mask.getWord<std::uint64_t>(word) = active[word];
    leaf->setValueMask(mask);
    return leaf;
}

}  // namespace

DistanceResult compute_distance(const std::vector<Vec3>& points, const Domain& domain, const DistanceOptions& options,
                                const RunContext& run) {
    require_valid(options, "compute_distance");
    if (domain.voxel_count() == 0) throw Error(Errc::InvalidInput, "the domain is empty");
    const std::vector<Vec3> positions = to_index_space(points, domain);
    detail::require_tube_memory(points, domain, {options.max_distance, 0, false}, "distance", run);
    const detail::CoordBBox box = detail::box_of(domain);
    const auto h = float(domain.voxel_size), background = float(options.max_distance);
    DistanceResult result;
    with_threads(run, [&] {
        const detail::NearestField field =
            detail::nearest_points(positions, box, options.max_distance / domain.voxel_size, "distance", run);
        result.report.rounds = field.rounds;
        result.grid = make_grid(domain, background, "distance");
        std::vector<std::unique_ptr<Leaf>> leaves(field.leaves.size());
        tbb::parallel_for(std::size_t(0), leaves.size(),
                          [&](std::size_t n) { leaves[n] = make_leaf(field, field.leaves[n], box, h, background); });
        for (auto& leaf : leaves) {
            if (!leaf) continue;
            result.report.active_voxels += leaf->onVoxelCount();
            result.grid->tree().addLeaf(leaf.release());
        }
    });
    return result;
}

}  // namespace covol
