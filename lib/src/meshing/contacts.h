#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "mesh/triangle.h"

namespace covol::meshing {

/// Whether two triangles certainly have nothing in common beyond the corners and the side that they share: whether a
/// plane separates them by more than the rounding error. May be false for triangles that narrowly miss each other.
/// Triangles that share a side are apart unless they are folded flat onto each other.
[[nodiscard]] bool are_apart(const Positions& positions, const Triangle& s, const Triangle& t);

/// Finds triangles that touch each other, with a tree of bounding boxes whose leaves are runs of kRun nearby triangles.
class ContactFinder {
public:
    using Pair = std::pair<std::uint32_t, std::uint32_t>;

    /// @param positions, triangles  kept by reference.
    ContactFinder(const Positions& positions, const std::vector<Triangle>& triangles);

    /// Recomputes the boxes. Call after positions or corners of triangles have changed.
    void update();

    /// Pairs of triangles for which are_apart() is false, each once, lower number first, sorted. Removed triangles
    /// (with a corner that is not a vertex) touch nothing.
    /// @param was_free  whether the mesh is closed and had no contacts before its vertices moved by less than the size
    /// of a triangle. Parts in which the surface is a single sheet are then skipped, see find_single_sheets().
    [[nodiscard]] std::vector<Pair> contacts(bool was_free);
    /// The same for the pairs that contain one of the triangles `some`; single sheets are not skipped.
    [[nodiscard]] std::vector<Pair> contacts_of(const std::vector<std::uint32_t>& some) const;

    /// Divides the triangles into new runs. Call when most triangles have changed or many have been removed, because
    /// the boxes of the old runs are then unnecessarily large.
    void rebuild();
    /// Finds the cells of a lattice, as large as the largest triangle, in which the surface is a single sheet: no
    /// triangle in the cell or its 26 neighbours faces away from their mean normal, the direction of the sheet. There,
    /// a line in this direction crosses a closed surface without contacts only once, so that no triangles touch
    /// (compare the normal cones of Volino and Magnenat-Thalmann, Efficient self-collision detection, 1994).
    void find_single_sheets();
    /// The direction, a unit vector, of the single sheet that the last find_single_sheets() found around a point; 0 if
    /// it found none there.
    [[nodiscard]] Vec3 single_sheet(const Position& p) const;
    /// Enlarges the boxes after one triangle has moved or its corners have changed: much faster than update().
    void grow(std::uint32_t triangle);

    /// A triangle and the corners that it would have after a change.
    struct Change {
        std::uint32_t number;
        Triangle corners;
    };
    /// Whether one of the triangles `changed` would touch another triangle if they had their new corners and the two
    /// triangles `gone` were removed.
    [[nodiscard]] bool would_touch(const std::vector<Change>& changed, const std::array<std::uint32_t, 2>& gone) const;
    /// Whether there is a single sheet around a point according to the last find_single_sheets(), and these triangles
    /// face in its direction.
    [[nodiscard]] bool face_along_sheet(const std::vector<Change>& changed, const Position& around) const;

    /// Calls visit(number) for the triangles whose boxes may intersect that of a triangle with these corners, which
    /// need not be in the mesh.
    template <typename Visit>
    void near(const Triangle& t, const Visit& visit) const {
        descend(box_of(t), 0, [&](std::size_t place) { visit(order_[place]); });
    }

private:
    struct Box {
        Position low, high;
    };
    [[nodiscard]] Box box_of(const Triangle& t) const;
    static constexpr std::size_t kRun = 4;  ///< triangles in a leaf of the tree
    static void join(Box& box, const Box& other) {
        for (int a = 0; a < 3; ++a) {
            box.low[a] = std::min(box.low[a], other.low[a]);
            box.high[a] = std::max(box.high[a], other.high[a]);
        }
    }
    static bool meet(const Box& a, const Box& b) {
        for (int k = 0; k < 3; ++k)
            if (a.low[k] > b.high[k] || a.high[k] < b.low[k]) return false;
        return true;
    }
    template <typename Visit>
    void descend(const Box& box, std::size_t first_run, const Visit& visit) const;
    void add_contact(std::uint32_t s, std::uint32_t t, std::vector<Pair>& pairs) const;

    const Positions* positions_ = nullptr;
    const std::vector<Triangle>* triangles_ = nullptr;
    /// The triangles in the order of the tree's leaves, and the position of each triangle in order_.
    std::vector<std::uint32_t> order_, place_;
    std::vector<Box> boxes_;           ///< of a binary tree: node n has the children 2 n + 1 and 2 n + 2
    std::vector<Box> triangle_boxes_;  ///< of single triangles, in the order of order_
    struct Cell {
        std::uint64_t key;
        Vec3 direction;
    };
    [[nodiscard]] std::uint64_t key_of(const Position& p, int dx = 0, int dy = 0, int dz = 0) const;
    [[nodiscard]] const Cell* cell_at(std::uint64_t key) const;
    std::vector<Cell> cells_;  ///< sorted by key
    Position cell_origin_{};
    float cell_size_ = 1;
    std::size_t runs_ = 1;  ///< leaves of the tree, a power of two
};

/// Calls visit(position in order_) for the triangles in `first_run` and later runs whose boxes intersect `box`.
template <typename Visit>
void ContactFinder::descend(const Box& box, std::size_t first_run, const Visit& visit) const {
    struct Node {
        std::size_t number, end, runs;  // the node contains the runs [end - runs, end)
    };
    Node stack[64];
    int size = 0;
    stack[size++] = {0, runs_, runs_};
    while (size > 0) {
        const auto [node, end, runs] = stack[--size];
        if (end <= first_run || !meet(boxes_[node], box)) continue;
        if (runs > 1) {
            stack[size++] = {2 * node + 2, end, runs / 2};
            stack[size++] = {2 * node + 1, end - runs / 2, runs / 2};
            continue;
        }
        for (std::size_t n = (end - 1) * kRun; n < std::min(end * kRun, order_.size()); ++n)
            if (meet(triangle_boxes_[n], box)) visit(n);
    }
}

}  // namespace covol::meshing
