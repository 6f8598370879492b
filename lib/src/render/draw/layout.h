#pragma once
// Where a figure's parts lie.
#include <array>
#include <vector>

#include "render/draw/canvas.h"

namespace covol::figure {

/// A part whose sides are known, before its scale is.
struct Cell {
    double width = 1, height = 1;  ///< world units
};

/// Columns of parts at one scale, each from the top.
struct Tiling {
    std::vector<std::vector<Cell>> columns;
    /// Pixel positions, column by column, and the scale at which it fits into `room`, in its middle.
    struct Placed {
        std::vector<Rect> at;
        Rect bounds;
        double pixel = 1;  ///< world units
    };
    [[nodiscard]] Placed place(const Rect& room, int gap) const;
};

/// Ways to lay three parts, in order: the first and the third in a column and the second beside; the first and, beside
/// it, the others in a column; all in a column; all in a row.
[[nodiscard]] std::vector<Tiling> ways_for_three(const std::array<Cell, 3>& parts);
/// Ways to lay equal parts in columns.
[[nodiscard]] std::vector<Tiling> ways_for_equals(double width, double height, int count);

/// A view, and parts beside or below it.
struct Split {
    Rect view;
    Tiling::Placed parts;
    int way = 0;  ///< of those given
};
/// The split that leaves the least of `room` empty; the view gets somewhat more than the parts.
/// @param aspect  what is in the view: its width over its height
/// @param rim     pixels below what is in the view, for a scale bar
[[nodiscard]] Split split(const Rect& room, double aspect, int rim, const std::vector<Tiling>& ways, int gap);
/// The parts alone, as large as they can be.
[[nodiscard]] Split fill(const Rect& room, const std::vector<Tiling>& ways, int gap);

}  // namespace covol::figure
