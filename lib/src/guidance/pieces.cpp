#include "guidance/pieces.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <algorithm>
#include <cmath>

namespace covol::guidance {
namespace {

constexpr double kSmall = 0.01;  // of the largest
constexpr int kMarkVoxels = 2;   // around a piece

using Pieces = std::vector<openvdb::MaskGrid::Ptr>;

/// The connected parts of the active voxels of one sign, the largest first.
Pieces pieces_of(const FloatGrid& level_set, bool inside) {
    openvdb::MaskGrid voxels;
    for (auto leaf = level_set.tree().cbeginLeaf(); leaf; ++leaf) {
        auto* mask = voxels.tree().touchLeaf(leaf->origin());
        for (auto value = leaf->cbeginValueOn(); value; ++value)
            if ((*value < 0) == inside) mask->setValueOn(value.pos());
    }
    Pieces pieces;
    openvdb::tools::segmentActiveVoxels(voxels, pieces);
    return pieces;
}

bool has_mark(const openvdb::MaskGrid& piece, const FloatGrid& level_set, const std::vector<Vec3>& marks) {
    openvdb::CoordBBox box = piece.evalActiveVoxelBoundingBox();
    box.expand(kMarkVoxels);
    return std::any_of(marks.begin(), marks.end(), [&](const Vec3& m) {
        return box.isInside(openvdb::Coord::round(level_set.worldToIndex(openvdb::Vec3d(m[0], m[1], m[2]))));
    });
}

}  // namespace

void drop_unmarked_pieces(FloatGrid& level_set, const std::vector<Vec3>& marks) {
    const auto limit = float(0.5 * level_set.voxelSize()[0]);
    auto accessor = level_set.getAccessor();
    for (const bool inside : {true, false}) {
        const Pieces pieces = pieces_of(level_set, inside);
        for (std::size_t n = 1; n < pieces.size(); ++n) {
            if (double(pieces[n]->activeVoxelCount()) > kSmall * double(pieces[0]->activeVoxelCount())) continue;
            if (has_mark(*pieces[n], level_set, marks)) continue;
            for (auto value = pieces[n]->cbeginValueOn(); value; ++value)
                accessor.setValue(value.getCoord(), inside ? limit : -limit);
        }
    }
}

}  // namespace covol::guidance
