#pragma once
// Layout of a figure's parts.
#include <array>
#include <vector>

#include "render/draw/canvas.h"

namespace covol::figure {

/// The size of a part of a figure, before a scale is chosen.
struct Cell {
    double width = 1, height = 1;  ///< world units
};

/// Columns of parts at one scale, each filled from the top.
struct Tiling {
    std::vector<std::vector<Cell>> columns;
    /// The positions of the parts in pixels, column by column, and the scale at which the tiling, centred, fits into
    /// `available`.
    struct Placed {
        std::vector<Rect> at;
        Rect bounds;
        double pixel = 1;  ///< world units
    };
    [[nodiscard]] Placed place(const Rect& available, int gap) const;
};

/// The four ways to arrange three parts, in this order: the first above the third, and the second beside them; the
/// first, and beside it the second above the third; all in a column; all in a row.
[[nodiscard]] std::vector<Tiling> ways_for_three(const std::array<Cell, 3>& parts);
/// Ways to arrange equal parts in columns.
[[nodiscard]] std::vector<Tiling> ways_for_equals(double width, double height, int count);

/// A view, and parts beside or below it.
struct Split {
    Rect view;
    Tiling::Placed parts;
    int way = 0;  ///< index of the chosen tiling among those given
};
/// The split of `available` in which view and parts are as large as possible and leave little empty space; the size of
/// the view has more weight.
/// @param aspect  width of the view's content divided by its height
/// @param rim     pixels below the view's content, for a scale bar
[[nodiscard]] Split split(const Rect& available, double aspect, int rim, const std::vector<Tiling>& ways, int gap);
/// The parts alone, as large as they can be.
[[nodiscard]] Split fill(const Rect& available, const std::vector<Tiling>& ways, int gap);

}  // namespace covol::figure
