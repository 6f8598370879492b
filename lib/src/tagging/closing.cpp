// Morphological closing of a tagged body: the exterior is dilated by the tag distance.
#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>

#include "covol/band.h"
#include "covol/error.h"
#include "distance/memory_need.h"
#include "distance/nearest.h"
#include "grid/flood_tiles.h"
#include "grid/sign_masks.h"
#include "redistance/interface_patches.h"
#include "redistance/tracking.h"

namespace covol {
namespace {

using Leaf = FloatGrid::TreeType::LeafNodeType;

/// The voxels below zero of a level set's leaf, or of the tile in its place.
detail::LeafMask inside_of(const FloatGrid& level_set, const detail::Coord& origin) {
    if (const Leaf* leaf = level_set.tree().probeConstLeaf(origin)) return detail::negative_mask(leaf->buffer().data());
    detail::LeafMask mask;
    mask.fill(level_set.tree().getValue(origin) < 0.0F ? ~std::uint64_t(0) : 0);
    return mask;
}

/// Inside the body D - d, where d is the distance to the body's surface: the signed distance to the closed body.
/// Outside an arbitrary positive value. Clamped to [-reach, reach]. Null if no voxel lies deeper than D.
/// @param surface  points of the body's surface, index space
FloatGridPtr grown_exterior(const FloatGrid& body, const std::vector<Vec3>& surface, const Domain& domain, float D,
                            float reach, const RunContext& run) {
    const detail::CoordBBox box = detail::box_of(domain);
    const auto h = float(domain.voxel_size);
    // The line from a voxel inside to its nearest point lies inside, so that only leaves with inside voxels are needed.
    const detail::NearestField field =
        detail::nearest_points(surface, box, double(D + reach) / h, "distance", run,
                               [&](const detail::Coord& origin) { return detail::any_on(inside_of(body, origin)); });
    std::vector<std::unique_ptr<Leaf>> leaves(field.leaves.size());
    std::atomic<bool> any{false};
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
        const detail::NearestLeaf& nearest = field.leaves[n];
        alignas(32) float d[detail::kLeafSize];
        detail::squared_distances(field, nearest, d);
        const detail::LeafMask inside = inside_of(body, nearest.origin),
                               valid = detail::mask_in_box(nearest.origin, box);
        bool is_near = false, is_deep = false;
        for (int at = 0; at < detail::kLeafSize; ++at) {
            const float depth = detail::is_on(valid, at) ? std::min(h * std::sqrt(d[at]), D + reach) : D + reach;
            d[at] = std::min(detail::is_on(inside, at) ? D - depth : D, reach);
            is_near |= depth < D + reach;
            is_deep |= d[at] < 0.0F;
        }
        if (is_deep) any = true;
        if (!is_near) return;
        leaves[n] = std::make_unique<Leaf>(nearest.origin, reach, false);
        std::copy_n(d, detail::kLeafSize, leaves[n]->buffer().data());
    });
    if (!any) return nullptr;
    FloatGridPtr grown = make_grid(domain, reach, "band");
    grown->setGridClass(openvdb::GRID_LEVEL_SET);
    for (auto& leaf : leaves)
        if (leaf) grown->tree().addLeaf(leaf.release());
    detail::flood_tiles(*grown, domain);
    return grown;
}

}  // namespace

FloatGridPtr close_by_ball(const FloatGrid& band, double tag_distance, const RunContext& run) {
    const Domain domain = domain_of(band);
    const double reach = (detail::kTrackingWidth + 1) * domain.voxel_size;
    FloatGridPtr closed;
    with_threads(run, [&] {
        std::vector<Vec3> surface;
        {
            const detail::InterfacePatches tagged = detail::find_interface(band, domain, detail::DomainEnd::Open, run);
            for (const detail::Patch& p : tagged.patches)
                surface.push_back(
                    domain.index_to_world({p.origin[0] + double(p.center[0]), p.origin[1] + double(p.center[1]),
                                           p.origin[2] + double(p.center[2])}));
        }
        if (surface.empty()) return;
        detail::require_tube_memory(surface, domain, {tag_distance + reach, 0, false}, "closing", run);
        for (Vec3& p : surface) p = domain.world_to_index(p);
        closed = grown_exterior(band, surface, domain, float(tag_distance), float(reach), run);
        if (closed) detail::track_surface(*closed, domain, detail::kTrackingWidth);
    });
    return closed;
}

}  // namespace covol
