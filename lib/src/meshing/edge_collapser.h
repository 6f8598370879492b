#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "mesh/corner_table.h"
#include "meshing/contacts.h"

namespace covol::meshing {

/// Draws edges together, one after the other, where that leaves the mesh manifold, of its topology and free of
/// contacts.
class EdgeCollapser {
public:
    /// All three are kept by reference, and changed by collapse().
    EdgeCollapser(CornerTable& table, Positions& positions, ContactFinder& finder)
        : table_(table), positions_(positions), finder_(finder) {}

    /// A triangle that a collapse leaves, with the corner that moves.
    struct Left {
        std::uint32_t number, mover, next, previous;
    };

    /// Looks at the edge that a corner faces. @return whether it can be drawn together as far as the topology goes
    bool look(std::uint32_t corner);
    /// The edge's ends; the first stays.
    [[nodiscard]] std::uint32_t kept() const { return kept_; }
    [[nodiscard]] std::uint32_t lost() const { return lost_; }
    /// What the collapse leaves around the two, and the two triangles that go.
    [[nodiscard]] const std::vector<Left>& left() const { return left_; }
    [[nodiscard]] const std::array<std::uint32_t, 2>& going() const { return going_; }

    /// Draws the edge together in a point unless a triangle would touch another that it does not share a corner with,
    /// or more of one that it does. @return whether it was. @pre look() was true, and nothing has changed since.
    bool collapse(const Position& there);

private:
    CornerTable& table_;
    Positions& positions_;
    ContactFinder& finder_;
    std::uint32_t corner_ = 0, kept_ = 0, lost_ = 0;
    std::vector<Left> left_;
    std::array<std::uint32_t, 2> going_{};
};

}  // namespace covol::meshing
