#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "mesh/triangle.h"

namespace covol::meshing {

/// Adjacency of a manifold mesh, closed or with boundary. Corner 3 t + k is corner k of triangle t. The edge opposite
/// to this corner belongs to a second triangle, whose corner opposite to the same edge is opposite(3 t + k) (Rossignac
/// et al., Corner table, 1999).
class CornerTable {
public:
    static constexpr std::uint32_t kNone = ~std::uint32_t(0);

    /// @param triangles  kept by reference, and changed by flip() and collapse().
    /// @throws Error InvalidInput if an edge has more than two triangles, or two that contain it in the same direction.
    CornerTable(std::vector<Triangle>& triangles, std::size_t vertices);

    static std::uint32_t next(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
    static std::uint32_t previous(std::uint32_t corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }
    [[nodiscard]] std::uint32_t vertex(std::uint32_t corner) const { return triangles_[corner / 3][corner % 3]; }
    [[nodiscard]] std::uint32_t opposite(std::uint32_t corner) const { return opposite_[corner]; }
    [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }
    [[nodiscard]] std::size_t vertices() const { return corner_of_.size(); }
    [[nodiscard]] bool is_boundary(std::uint32_t v) const { return on_boundary_[v] != 0; }
    [[nodiscard]] bool is_closed() const {
        return std::find(on_boundary_.begin(), on_boundary_.end(), 1) == on_boundary_.end();
    }
    /// A corner at the vertex, or kNone if the vertex has no triangle. At a boundary vertex it is the first corner in
    /// counter-clockwise order.
    [[nodiscard]] std::uint32_t corner_of(std::uint32_t v) const { return corner_of_[v]; }

    /// Calls visit(corner) for each corner at the vertex, counter-clockwise.
    template <typename Visit>
    void around(std::uint32_t v, const Visit& visit) const {
        const std::uint32_t first = corner_of_[v];
        for (std::uint32_t c = first; c != kNone;) {
            visit(c);
            const std::uint32_t across = opposite_[next(c)];
            if (across == kNone) break;
            c = next(across);
            if (c == first) break;
        }
    }
    [[nodiscard]] bool adjacent(std::uint32_t v, std::uint32_t w) const;
    [[nodiscard]] int valence(std::uint32_t v) const;

    /// Whether the mesh remains manifold if the edge opposite to the corner is flipped.
    [[nodiscard]] bool can_flip(std::uint32_t corner) const;
    /// Flips the edge opposite to the corner; the new edge is opposite to next(corner). @pre can_flip(corner)
    void flip(std::uint32_t corner);
    /// Undoes flip(corner).
    void unflip(std::uint32_t corner);

    /// Whether the edge opposite to the corner can be collapsed such that the mesh remains manifold with the same
    /// topology: no vertices except the two opposite to the edge are adjacent to both of its ends.
    [[nodiscard]] bool can_collapse(std::uint32_t corner) const;
    /// Collapses the edge from vertex(next(corner)) to vertex(previous(corner)) into the former; the latter and two
    /// triangles are removed, see is_gone(). @pre can_collapse(corner)
    void collapse(std::uint32_t corner);
    [[nodiscard]] bool is_gone(std::uint32_t triangle) const { return triangles_[triangle][0] == kNone; }

private:
    void link(std::uint32_t a, std::uint32_t b) {
        if (a != kNone) opposite_[a] = b;
        if (b != kNone) opposite_[b] = a;
    }

    std::vector<Triangle>& triangles_;
    std::vector<std::uint32_t> opposite_, corner_of_;
    std::vector<std::uint8_t> on_boundary_;
};

/// Removes the triangles whose first vertex is CornerTable::kNone, see is_gone(), and vertices without triangles.
void remove_gone(std::vector<Triangle>& triangles, Positions& positions);

}  // namespace covol::meshing
