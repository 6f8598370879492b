#pragma once
#include <vector>

#include "covol/run.h"
#include "grid/leaf_band.h"

namespace covol::detail {

/// A band's leaves and the gaps between them, column by column along k: the whole space in O(leaves + columns) pieces.
///
/// The columns span the whole domain, or the leaves' box enlarged by one leaf on each side, up to the domain's end.
class LeafColumns {
public:
    /// A leaf, or a run of leaf-sized blocks without a leaf. k in leaf units, half-open.
    struct Piece {
        std::int32_t begin, end;
        std::int32_t leaf;  ///< -1: a run
        std::int32_t column;
    };

    enum class Extent { Leaves, Domain };
    /// @pre at least one leaf; each meets the domain.
    LeafColumns(const LeafBand& band, const CoordBBox& domain, Extent extent = Extent::Leaves);

    [[nodiscard]] const std::vector<Piece>& pieces() const noexcept { return pieces_; }
    [[nodiscard]] std::int32_t piece_of_leaf(std::size_t leaf) const { return piece_of_leaf_[leaf]; }
    /// The voxels of a piece, including those outside the domain.
    [[nodiscard]] CoordBBox voxels(const Piece& piece) const;
    /// The piece that contains a voxel, -1 outside of all columns.
    [[nodiscard]] std::int32_t find(const Coord& voxel) const;
    /// Whether the piece lies at the columns' outer faces, beyond which there is free space or the end of the domain.
    [[nodiscard]] bool at_border(const Piece& piece) const;

    /// Calls visit(other, di, dj, dk) for each piece that shares a face with `piece`, (di,dj,dk) being the direction.
    template <typename Visit>
    void for_each_neighbour(std::int32_t number, Visit&& visit) const {
        const Piece& piece = pieces_[number];
        if (piece.begin > lo_.z()) visit(number - 1, 0, 0, -1);
        if (piece.end <= hi_.z()) visit(number + 1, 0, 0, 1);
        constexpr int kSides[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
        const int width = hi_.y() - lo_.y() + 1, i = piece.column / width, j = piece.column % width;
        for (const auto& [di, dj] : kSides) {
            if (i + di < 0 || i + di > hi_.x() - lo_.x() || j + dj < 0 || j + dj >= width) continue;
            for (std::int32_t other = find_in((i + di) * width + j + dj, piece.begin);
                 other < start_[(i + di) * width + j + dj + 1] && pieces_[other].begin < piece.end; ++other)
                visit(other, di, dj, 0);
        }
    }

private:
    [[nodiscard]] std::int32_t find_in(std::int32_t column, std::int32_t k) const;
    Coord lo_, hi_;  // leaf units, inclusive
    std::vector<std::int32_t> start_;
    std::vector<Piece> pieces_;
    std::vector<std::int32_t> piece_of_leaf_;
};

/// The runs that are inside, given the inside voxels of the leaves: those next to an inside voxel or an inside run.
/// @pre no interface passes between a leaf and a run.
[[nodiscard]] std::vector<bool> inside_runs(const LeafColumns& columns, const std::vector<LeafMask>& inside);

/// Spreads `mask` through the open voxels of its leaf, through faces.
void spread(LeafMask& mask, const LeafMask& open);

/// Calls visit(part) for each part of a leaf's mask that is connected through faces, in the order of their first
/// voxels.
template <typename Visit>
void for_each_part(LeafMask mask, Visit&& visit) {
    for (std::size_t word = 0; word < mask.size(); ++word)
        while (mask[word] != 0) {
            LeafMask part{};
            part[word] = mask[word] & -mask[word];
            spread(part, mask);
            for (std::size_t other = word; other < mask.size(); ++other) mask[other] &= ~part[other];
            visit(part);
        }
}

/// The result of a flood fill.
struct Flood {
    std::vector<LeafMask> leaves;  ///< by leaf: the voxels that were reached
    std::vector<bool> pieces;      ///< by piece: whether a run was reached
};

/// Flood fill of the open voxels, through faces, from the columns' border and from the `seeds`.
/// @param open  by leaf; runs are open.
[[nodiscard]] Flood flood(const LeafColumns& columns, const LeafBand& band, const std::vector<LeafMask>& open,
                          const CoordBBox& domain, const std::vector<Coord>& seeds);

}  // namespace covol::detail
