#include "detail/pieces.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <algorithm>
#include <cmath>

namespace covol::detail {
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

void erase(const openvdb::MaskGrid& piece, FloatGrid& level_set, bool inside) {
    const auto limit = float(0.5 * level_set.voxelSize()[0]);
    auto accessor = level_set.getAccessor();
    for (auto value = piece.cbeginValueOn(); value; ++value) accessor.setValue(value.getCoord(), inside ? limit : -limit);
}

}  // namespace

void drop_unmarked_pieces(FloatGrid& level_set, const std::vector<Vec3>& marks) {
    for (const bool inside : {true, false}) {
        const Pieces pieces = pieces_of(level_set, inside);
        for (std::size_t n = 1; n < pieces.size(); ++n) {
            if (double(pieces[n]->activeVoxelCount()) > kSmall * double(pieces[0]->activeVoxelCount())) continue;
            if (has_mark(*pieces[n], level_set, marks)) continue;
            erase(*pieces[n], level_set, inside);
        }
    }
}

std::size_t drop_bare_pieces(FloatGrid& level_set, const std::vector<Vec3>& points, std::size_t least) {
    std::size_t dropped = 0;
    for (const bool inside : {true, false}) {
        const Pieces pieces = pieces_of(level_set, inside);
        if (pieces.size() < 2) continue;
        openvdb::Int32Grid owner(-1);
        auto owners = owner.getAccessor();
        for (std::size_t n = 0; n < pieces.size(); ++n)
            for (auto value = pieces[n]->cbeginValueOn(); value; ++value) owners.setValue(value.getCoord(), int(n));
        std::vector<std::size_t> resting(pieces.size(), 0);
        for (const Vec3& p : points) {
            const openvdb::Coord c = openvdb::Coord::round(level_set.worldToIndex(openvdb::Vec3d(p[0], p[1], p[2])));
            std::array<int, 27> beside;
            for (int n = 0; n < 27; ++n) beside[std::size_t(n)] = owners.getValue(c.offsetBy(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1));
            std::sort(beside.begin(), beside.end());
            const auto end = std::unique(beside.begin(), beside.end());
            for (auto at = beside.begin(); at != end; ++at)
                if (*at >= 0) ++resting[std::size_t(*at)];
        }
        for (std::size_t n = 1; n < pieces.size(); ++n) {
            if (resting[n] >= least) continue;
            erase(*pieces[n], level_set, inside);
            ++dropped;
        }
    }
    return dropped;
}

}  // namespace covol::detail
