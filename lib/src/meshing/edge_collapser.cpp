#include "meshing/edge_collapser.h"

#include <algorithm>

namespace covol::meshing {

bool EdgeCollapser::look(std::uint32_t corner) {
    if (!table_.can_collapse(corner)) return false;
    corner_ = corner;
    kept_ = table_.vertex(CornerTable::next(corner));
    lost_ = table_.vertex(CornerTable::previous(corner));
    going_ = {corner / 3, table_.opposite(corner) / 3};
    left_.clear();
    for (const std::uint32_t v : {kept_, lost_})
        table_.around(v, [&](std::uint32_t c) {
            if (c / 3 != going_[0] && c / 3 != going_[1])
                left_.push_back({c / 3, v, table_.vertex(CornerTable::next(c)), table_.vertex(CornerTable::previous(c))});
        });
    return true;
}

bool EdgeCollapser::collapse(const Position& there, bool trust) {
    const Position before = positions_[kept_];
    positions_[kept_] = there;
    if (!(trust && looks_along_sheet(there)) && touches()) {
        positions_[kept_] = before;
        return false;
    }
    table_.collapse(corner_);
    for (const Left& t : left_) finder_.grow(t.number);
    return true;
}

bool EdgeCollapser::looks_along_sheet(const Position& there) const {
    constexpr double kFacing = 0.3;
    const Vec3 direction = finder_.single_sheet(there);
    return dot(direction, direction) > 0 && std::all_of(left_.begin(), left_.end(), [&](const Left& t) {
        const Vec3 n = area_normal(positions_, {kept_, t.next, t.previous});
        return dot(n, direction) > kFacing * length(n);
    });
}

bool EdgeCollapser::touches() const {
    const auto as_left = [&](const Left& t) { return Triangle{kept_, t.next, t.previous}; };
    for (std::size_t n = 0; n < left_.size(); ++n)
        for (std::size_t m = n + 1; m < left_.size(); ++m)
            if (!are_apart(positions_, as_left(left_[n]), as_left(left_[m]))) return true;
    const auto is_changed = [&](std::uint32_t t) {
        return t == going_[0] || t == going_[1] || std::any_of(left_.begin(), left_.end(), [&](const Left& l) { return l.number == t; });
    };
    for (const Left& l : left_) {
        bool touching = false;
        finder_.near(as_left(l), [&](std::uint32_t t) {
            touching = touching || (!table_.is_gone(t) && !is_changed(t) && !are_apart(positions_, as_left(l), table_.triangles()[t]));
        });
        if (touching) return true;
    }
    return false;
}

}  // namespace covol::meshing
