#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "mesh/corner_table.h"
#include "meshing/contacts.h"

namespace covol::meshing {

/// Collapses edges one after the other, if the mesh then remains manifold, keeps its topology and has no contacts.
class EdgeCollapser {
public:
    /// The table, the positions and the finder are kept by reference, and collapse() changes them.
    EdgeCollapser(CornerTable& table, Positions& positions, ContactFinder& finder)
        : table_(table), positions_(positions), finder_(finder) {}

    /// A triangle that remains after the collapse: its number, its corner at an end of the edge (`mover`), and its
    /// other two corners in order.
    struct Left {
        std::uint32_t number, mover, next, previous;
    };

    /// Selects the edge opposite to a corner. @return whether the topology permits its collapse
    bool select(std::uint32_t corner);
    /// The edge's ends: the vertex that remains after the collapse, and the vertex that is removed.
    [[nodiscard]] std::uint32_t kept() const { return kept_; }
    [[nodiscard]] std::uint32_t lost() const { return lost_; }
    /// The triangles that remain around the two ends, and the two triangles beside the edge, which are removed.
    [[nodiscard]] const std::vector<Left>& left() const { return left_; }
    [[nodiscard]] const std::array<std::uint32_t, 2>& going() const { return going_; }

    /// Collapses the edge to `there` unless a triangle would then touch another one beyond shared corners. @return
    /// whether it was collapsed. @pre select() returned true, and nothing has changed since.
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
