#include "detail/pieces.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "covol/band.h"

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

/// The regions of one sign that hardly a point rests on.
class BarePieces {
public:
    BarePieces(FloatGrid& level_set, const std::vector<Vec3>& points, std::size_t least, bool inside)
        : level_set_(level_set), least_(least), inside_(inside), pieces_(pieces_of(level_set, inside)), box_(level_set.evalActiveVoxelBoundingBox()) {
        auto owners = owner_.getAccessor();
        for (std::size_t n = 0; n < pieces_.size(); ++n)
            for (auto value = pieces_[n]->cbeginValueOn(); value; ++value) owners.setValue(value.getCoord(), int(n));
        resting_.assign(pieces_.size(), 0);
        if (pieces_.size() < 2) return;
        for (const Vec3& p : points) {
            const openvdb::Coord c = openvdb::Coord::round(level_set.worldToIndex(openvdb::Vec3d(p[0], p[1], p[2])));
            std::array<int, 27> beside;
            for (int n = 0; n < 27; ++n) beside[std::size_t(n)] = owners.getValue(c.offsetBy(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1));
            std::sort(beside.begin(), beside.end());
            const auto end = std::unique(beside.begin(), beside.end());
            for (auto at = beside.begin(); at != end; ++at)
                if (*at >= 0) ++resting_[std::size_t(*at)];
        }
    }

    /// @return how many regions changed sign
    std::size_t drop() {
        std::size_t dropped = 0;
        std::vector<char> seen(pieces_.size(), 0);
        for (std::size_t n = 1; n < pieces_.size(); ++n) {
            if (seen[n] || resting_[n] >= least_) continue;
            const openvdb::MaskGrid::Ptr region = bare_region(n, seen);
            if (!region) continue;
            erase(*region, level_set_, inside_);
            ++dropped;
        }
        return dropped;
    }

private:
    /// All that hangs together with a piece, what is active nowhere included; null where enough points rest on it, or it is
    /// the main body's or what lies around it.
    openvdb::MaskGrid::Ptr bare_region(std::size_t piece, std::vector<char>& seen) const {
        const openvdb::MaskGrid::Ptr region = openvdb::MaskGrid::create();
        auto member = region->getAccessor();
        auto values = level_set_.getConstAccessor();
        auto owners = owner_.getConstAccessor();
        std::size_t resting = 0;
        std::vector<openvdb::Coord> front{pieces_[piece]->cbeginValueOn().getCoord()};
        member.setValueOn(front.front());
        std::vector<char> counted(pieces_.size(), 0);
        while (!front.empty()) {
            const openvdb::Coord at = front.back();
            front.pop_back();
            if (!box_.isInside(at)) return nullptr;
            if (const int own = owners.getValue(at); own >= 0 && !counted[std::size_t(own)]) {
                counted[std::size_t(own)] = seen[std::size_t(own)] = 1;
                resting += resting_[std::size_t(own)];
                if (own == 0 || resting >= least_) return nullptr;
            }
            for (int face = 0; face < 6; ++face) {
                openvdb::Coord next = at;
                next[face / 2] += face % 2 ? 1 : -1;
                if ((values.getValue(next) < 0) != inside_ || member.isValueOn(next)) continue;
                member.setValueOn(next);
                front.push_back(next);
            }
        }
        return region;
    }

    FloatGrid& level_set_;
    std::size_t least_;
    bool inside_;
    Pieces pieces_;
    openvdb::CoordBBox box_;
    openvdb::Int32Grid owner_{-1};
    std::vector<std::size_t> resting_;  // points, on each piece
};

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
        const std::size_t now = BarePieces(level_set, points, least, inside).drop();
        if (now == 0) continue;
        dropped += now;
        level_set.setTree(start_from_grid(domain_of(level_set), level_set)->treePtr());
    }
    return dropped;
}

}  // namespace covol::detail
