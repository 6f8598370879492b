#include "render/layout.h"

#include <algorithm>
#include <cmath>

namespace covol::figure {
namespace {

double area(const Tiling::Placed& placed) {
    double sum = 0;
    for (const Rect& rect : placed.at) sum += double(rect.width) * rect.height;
    return sum;
}

double fitted(const Rect& view, double aspect, int rim) {
    const double width = view.width, height = std::max(1, view.height - rim);
    return width > height * aspect ? height * height * aspect : width * width / aspect;
}

}  // namespace

Tiling::Placed Tiling::place(const Rect& room, int gap) const {
    std::vector<double> widths, heights;
    for (const Cell& cell : cells) {
        widths.resize(std::max(widths.size(), std::size_t(cell.column) + 1));
        heights.resize(std::max(heights.size(), std::size_t(cell.row) + 1));
        widths[cell.column] = std::max(widths[cell.column], cell.width);
        heights[cell.row] = std::max(heights[cell.row], cell.height);
    }
    double width = 0, height = 0;
    for (const double w : widths) width += w;
    for (const double h : heights) height += h;
    const int gaps_x = gap * int(widths.size() - 1), gaps_y = gap * int(heights.size() - 1);
    Placed placed;
    placed.pixel =
        std::max(width / std::max(1, room.width - gaps_x), height / std::max(1, room.height - gaps_y));
    const auto pixels = [&](double length) { return std::max(1, int(std::floor(length / placed.pixel + 1e-9))); };
    std::vector<int> x{0}, y{0};
    for (const double w : widths) x.push_back(x.back() + pixels(w) + gap);
    for (const double h : heights) y.push_back(y.back() + pixels(h) + gap);
    placed.bounds = {room.x + (room.width - (x.back() - gap)) / 2, room.y + (room.height - (y.back() - gap)) / 2,
                     x.back() - gap, y.back() - gap};
    for (const Cell& cell : cells)
        placed.at.push_back({placed.bounds.x + x[cell.column], placed.bounds.y + y[cell.row], pixels(cell.width),
                             pixels(cell.height)});
    return placed;
}

std::vector<Tiling> ways_for_planes(const std::array<std::array<double, 2>, 3>& sizes) {
    const auto cell = [&](int n, int column, int row) { return Cell{sizes[n][0], sizes[n][1], column, row}; };
    return {{{cell(0, 0, 0), cell(1, 1, 0), cell(2, 0, 1)}},
            {{cell(0, 0, 0), cell(1, 1, 0), cell(2, 2, 0)}},
            {{cell(0, 0, 0), cell(1, 0, 1), cell(2, 0, 2)}}};
}

std::vector<Tiling> ways_for_equals(double width, double height, int count) {
    std::vector<Tiling> ways;
    for (int columns = 1; columns <= count; ++columns) {
        if (columns > 1 && (count + columns - 1) / columns == (count + columns - 2) / (columns - 1)) continue;
        Tiling tiling;
        for (int n = 0; n < count; ++n) tiling.cells.push_back({width, height, n % columns, n / columns});
        ways.push_back(tiling);
    }
    return ways;
}

Split split(const Rect& room, double aspect, int rim, const std::vector<Tiling>& ways, int gap) {
    Split best;
    bool is_beside = true;
    double most = -1;
    for (int way = 0; way < int(ways.size()); ++way)
        for (const bool beside : {true, false})
            for (double share = 0.35; share < 0.76; share += 0.01) {
                Rect view = room, rest = room;
                (beside ? view.width : view.height) = int(share * (beside ? room.width : room.height));
                const int used = (beside ? view.width : view.height) + gap;
                (beside ? rest.x : rest.y) += used;
                (beside ? rest.width : rest.height) -= used;
                const Tiling::Placed parts = ways[way].place(rest, gap);
                const double score =
                    0.55 * std::log(fitted(view, aspect, rim)) + 0.45 * std::log(std::max(1.0, area(parts)));
                if (score <= most + 1e-9) continue;
                most = score;
                best = {view, parts, way};
                is_beside = beside;
            }
    // What the parts leave of their side goes to the view.
    int& corner = is_beside ? best.parts.bounds.x : best.parts.bounds.y;
    const int moved = (is_beside ? room.right() - best.parts.bounds.width : room.bottom() - best.parts.bounds.height) - corner;
    corner += moved;
    for (Rect& part : best.parts.at) (is_beside ? part.x : part.y) += moved;
    (is_beside ? best.view.width : best.view.height) = corner - gap - (is_beside ? room.x : room.y);
    return best;
}

Split fill(const Rect& room, const std::vector<Tiling>& ways, int gap) {
    Split best;
    double most = -1;
    for (int way = 0; way < int(ways.size()); ++way) {
        const Tiling::Placed parts = ways[way].place(room, gap);
        if (area(parts) <= most) continue;
        most = area(parts);
        best = {{}, parts, way};
    }
    return best;
}

}  // namespace covol::figure
