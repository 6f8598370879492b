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

constexpr int kFrameLayers = 4;     // the scheme looks two voxels far, redistancing one more
constexpr int kSeamLayers = 3;      // of one brick's voxels beside another, where their surfaces are compared
constexpr double kBeyondAll = 1e3;  // voxels: a bound that binds nothing

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

FloatGridPtr assemble(const BrickPlan& plan, const Domain& domain, const std::vector<std::size_t>& bricks,
                      const BrickStates& states) {
    FloatGridPtr whole = make_grid(domain, float(kHalfWidthVoxels * domain.voxel_size), "u");
    for (const std::size_t n : bricks) {
        const FloatGridPtr state = states(n);
        if (!state)
            throw Error(Errc::InvalidInput, "bricks: expected a state of brick " + std::to_string(n) + ", got none");
        CoordBBox box = bounds(plan.bricks[n].core);
        box.intersect(bounds({domain.min, domain.max}));
        if (!box.empty()) copy_leaves(*state, box, *whole);
    }
    detail::flood_tiles(*whole, domain);
    return whole;
}

Frame make_frame(const FloatGrid& start, const Domain& part, const Domain& whole) {
    const double h = part.voxel_size;
    const auto free = float(kBeyondAll * h), limit = float(kHalfWidthVoxels * h);
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
                // b where a is 0: slopes may differ with the phase in which the flow stopped.
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
