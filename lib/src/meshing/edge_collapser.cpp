#include "meshing/edge_collapser.h"

namespace covol::meshing {

bool EdgeCollapser::select(std::uint32_t corner) {
    if (!table_.can_collapse(corner)) return false;
    corner_ = corner;
    kept_ = table_.vertex(CornerTable::next(corner));
    lost_ = table_.vertex(CornerTable::previous(corner));
    going_ = {corner / 3, table_.opposite(corner) / 3};
    left_.clear();
    for (const std::uint32_t v : {kept_, lost_})
        table_.around(v, [&](std::uint32_t c) {
            if (c / 3 != going_[0] && c / 3 != going_[1])
                left_.push_back(
                    {c / 3, v, table_.vertex(CornerTable::next(c)), table_.vertex(CornerTable::previous(c))});
        });
    return true;
}

bool EdgeCollapser::collapse(const Position& there) {
    const Position before = positions_[kept_];
    positions_[kept_] = there;
    std::vector<ContactFinder::Change> changed;
    for (const Left& t : left_) changed.push_back({t.number, {kept_, t.next, t.previous}});
    if (finder_.would_touch(changed, going_)) {
        positions_[kept_] = before;
        return false;
    }
    table_.collapse(corner_);
    for (const Left& t : left_) finder_.grow(t.number);
    return true;
}

}  // namespace covol::meshing
