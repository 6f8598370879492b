#include "bricks/states.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>

#include "covol/error.h"
#include "grid/flood_tiles.h"

namespace covol::bricks {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

// Number of outermost layers of voxels that are held fixed. The scheme reads two of them, and redistancing reads one
// more; the fourth is a margin.
constexpr int kFrameLayers = 4;
// [voxels] Width by which the state of a brick extends beyond its core, and over which adjacent states are blended.
constexpr int kBlend = 8;
constexpr int kSeamLayers = 3;  // layers of a brick, next to another one, in which their surfaces are compared
// [voxels] Where the level set may move, the bounds of a Frame are this far below and above 0, so that they have no
// effect.
constexpr double kUnboundedVoxels = 1e3;

CoordBBox bounds(const VoxelBox& box) { return {Coord(box.min.data()), Coord(box.max.data())}; }

void copy_leaves(const FloatGrid& from, const CoordBBox& box, FloatGrid& to) {
    for (auto leaf = from.tree().cbeginLeaf(); leaf; ++leaf)
        if (box.hasOverlap(leaf->getNodeBoundingBox())) to.tree().addLeaf(new FloatGrid::TreeType::LeafNodeType(*leaf));
}

}  // namespace

FloatGridPtr leaves_within(const FloatGrid& u, const VoxelBox& box) {
    FloatGridPtr part = u.copyWithNewTree();
    copy_leaves(u, bounds(box), *part);
    return part;
}

void copy_leaves(const FloatGrid& from, const VoxelBox& box, FloatGrid& to) { copy_leaves(from, bounds(box), to); }

void count(const FloatGrid& u, const VoxelBox& box, std::int64_t& active_voxels, std::int64_t& leaves) {
    const CoordBBox all = bounds(box);
    for (auto leaf = u.tree().cbeginLeaf(); leaf; ++leaf) {
        if (!all.hasOverlap(leaf->getNodeBoundingBox())) continue;
        active_voxels += std::int64_t(leaf->onVoxelCount());
        ++leaves;
    }
}

/// Blends the states of adjacent bricks, which overlap within kBlend voxels on either side of the face between their
/// cores.
class SeamBlend {
public:
    SeamBlend(const BrickPlan& plan, const CoordBBox& box)
        : domain_(bounds({plan.domain.min, plan.domain.max})), box_(box), sums_(0.0F), weights_(0.0F) {}

    void add(const FloatGrid& state, const VoxelBox& core) {
        const CoordBBox deep = inner(core);
        for (auto leaf = state.tree().cbeginLeaf(); leaf; ++leaf) {
            const CoordBBox voxels = leaf->getNodeBoundingBox();
            if (deep.isInside(voxels) || !box_.hasOverlap(voxels)) continue;
            auto* sum = sums_.touchLeaf(leaf->origin());
            auto* weight = weights_.touchLeaf(leaf->origin());
            for (auto value = leaf->cbeginValueOn(); value; ++value) {
                const float own = weight_at(core, value.getCoord());
                sum->setValueOn(value.pos(), sum->getValue(value.pos()) + own * *value);
                weight->setValueOn(value.pos(), weight->getValue(value.pos()) + own);
            }
        }
    }

    void apply(FloatGrid& u) const {
        for (auto sum = sums_.cbeginLeaf(); sum; ++sum) {
            auto* leaf = u.tree().probeLeaf(sum->origin());
            const auto* weight = weights_.probeConstLeaf(sum->origin());
            if (leaf == nullptr) continue;
            for (auto value = leaf->beginValueOn(); value; ++value)
                if (const float all = weight->getValue(value.pos()); all > 0)
                    value.setValue(sum->getValue(value.pos()) / all);
        }
    }

private:
    /// The voxels of a core that no state of another brick reaches.
    [[nodiscard]] CoordBBox inner(const VoxelBox& core) const {
        CoordBBox box = bounds(core);
        for (int a = 0; a < 3; ++a) {
            if (box.min()[a] > domain_.min()[a]) box.min()[a] += kBlend;
            if (box.max()[a] < domain_.max()[a]) box.max()[a] -= kBlend;
        }
        return box;
    }

    /// The weight of a brick's state at a voxel: 1 deep in its core, 1/2 at the core's faces, 0 at the state's end.
    [[nodiscard]] float weight_at(const VoxelBox& core, const Coord& at) const {
        float depth = kBlend;
        for (int a = 0; a < 3; ++a) {
            if (core.min[a] > domain_.min()[a]) depth = std::min(depth, float(at[a] - core.min[a]) + 0.5F);
            if (core.max[a] < domain_.max()[a]) depth = std::min(depth, float(core.max[a] - at[a]) + 0.5F);
        }
        return std::max(0.0F, (kBlend + depth) / (2 * kBlend));
    }

    CoordBBox domain_, box_;
    FloatGrid::TreeType sums_, weights_;
};

FloatGridPtr assemble(const BrickPlan& plan, const Domain& domain, const std::vector<std::size_t>& bricks,
                      const BrickStates& states) {
    FloatGridPtr whole = make_grid(domain, float(kHalfWidthVoxels * domain.voxel_size), "u");
    const CoordBBox all = bounds({domain.min, domain.max});
    SeamBlend blend(plan, all);
    for (const std::size_t n : bricks) {
        const FloatGridPtr state = states(n);
        if (!state)
            throw Error(Errc::InvalidInput, "bricks: expected a state of brick " + std::to_string(n) + ", got none");
        CoordBBox box = bounds(plan.bricks[n].core);
        box.intersect(all);
        if (!box.empty()) copy_leaves(*state, box, *whole);
        if (plan.has_sweeps) blend.add(*state, plan.bricks[n].core);
    }
    blend.apply(*whole);
    detail::flood_tiles(*whole, domain);
    return whole;
}

Frame make_frame(const FloatGrid& start, const Domain& part, const Domain& whole) {
    const double h = part.voxel_size;
    const auto free = float(kUnboundedVoxels * h), limit = float(kHalfWidthVoxels * h);
    VoxelBox inner{part.min, part.max};
    for (int a = 0; a < 3; ++a) {
        if (part.min[a] > whole.min[a]) inner.min[a] += kFrameLayers;
        if (part.max[a] < whole.max[a]) inner.max[a] -= kFrameLayers;
    }
    Frame frame{make_grid(part, -free, "floor"), make_grid(part, free, "obstacle")};
    const CoordBBox moves = bounds(inner), all = bounds({part.min, part.max});
    for (auto leaf = start.tree().cbeginLeaf(); leaf; ++leaf) {
        const CoordBBox voxels = leaf->getNodeBoundingBox();
        if (moves.isInside(voxels) || !all.hasOverlap(voxels)) continue;
        auto* low = frame.floor->tree().touchLeaf(leaf->origin());
        auto* high = frame.obstacle->tree().touchLeaf(leaf->origin());
        for (auto value = leaf->cbeginValueOn(); value; ++value) {
            if (moves.isInside(value.getCoord()) || !(std::abs(*value) < limit)) continue;
            low->setValueOn(value.pos(), *value);
            high->setValueOn(value.pos(), *value);
        }
    }
    return frame;
}

VoxelBox beside(const VoxelBox& core, const VoxelBox& other) {
    VoxelBox box = other;
    for (int a = 0; a < 3; ++a) {
        box.min[a] = std::max(box.min[a], core.min[a] - kSeamLayers);
        box.max[a] = std::min(box.max[a], core.max[a] + kSeamLayers);
    }
    return box;
}

double gap_between(const FloatGrid& a, const FloatGrid& b, const VoxelBox& box) {
    const CoordBBox voxels = bounds(box);
    const auto a_at = a.getConstAccessor(), b_at = b.getConstAccessor();
    const double h = a.voxelSize()[0];
    double largest = 0;
    for (auto leaf = a.tree().cbeginLeaf(); leaf; ++leaf) {
        if (!voxels.hasOverlap(leaf->getNodeBoundingBox())) continue;
        for (auto value = leaf->cbeginValueOn(); value; ++value) {
            const Coord p = value.getCoord();
            for (int axis = 0; axis < 3; ++axis) {
                Coord q = p;
                ++q[axis];
                float next = 0;
                if (!voxels.isInside(p) || !voxels.isInside(q) || !a_at.probeValue(q, next)) continue;
                if ((*value < 0) == (next < 0)) continue;
                float first = 0, second = 0;
                const bool known = b_at.probeValue(p, first) && b_at.probeValue(q, second);
                // The distance between the surfaces of the level sets a and b is the interpolated value of b at the
                // zero crossing of a. The difference between the values of a and b would depend on their slopes as
                // well.
                const double there = double(*value) / (double(*value) - next);
                largest = std::max(largest, known ? std::abs(first + there * (second - first)) : kHalfWidthVoxels * h);
            }
        }
    }
    return largest / h;
}

}  // namespace covol::bricks

namespace covol {

double measure_seams(const BrickPlan& plan, std::size_t brick, const BrickStates& states) {
    const FloatGridPtr own = states(brick);
    if (!own) return kHalfWidthVoxels;
    double largest = 0;
    for (const std::size_t n : plan.bricks[brick].neighbours) {
        const FloatGridPtr other = states(n);
        if (!other) return kHalfWidthVoxels;
        const VoxelBox &here = plan.bricks[brick].core, &there = plan.bricks[n].core;
        largest = std::max({largest, bricks::gap_between(*own, *other, bricks::beside(here, there)),
                            bricks::gap_between(*other, *own, bricks::beside(there, here))});
    }
    return largest;
}

}  // namespace covol
