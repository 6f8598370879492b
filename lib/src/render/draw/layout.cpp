#include "render/draw/layout.h"

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

Tiling::Placed Tiling::place(const Rect& available, int gap) const {
    std::vector<double> widths;
    Placed placed;
    double all = 0;
    placed.pixel = 0;
    for (const std::vector<Cell>& column : columns) {
        double width = 0, height = 0;
        for (const Cell& cell : column) {
            width = std::max(width, cell.width);
            height += cell.height;
        }
        widths.push_back(width);
        all += width;
        placed.pixel = std::max(placed.pixel, height / std::max(1, available.height - gap * int(column.size() - 1)));
    }
    placed.pixel = std::max(placed.pixel, all / std::max(1, available.width - gap * int(columns.size() - 1)));
    const auto pixels = [&](double length) { return std::max(1, int(std::floor(length / placed.pixel + 1e-9))); };
    int x = 0, maximum = 0;
    for (std::size_t c = 0; c < columns.size(); ++c) {
        int y = 0;
        for (const Cell& cell : columns[c]) {
            placed.at.push_back({x, y, pixels(cell.width), pixels(cell.height)});
            y += placed.at.back().height + gap;
        }
        maximum = std::max(maximum, y - gap);
        x += pixels(widths[c]) + gap;
    }
    placed.bounds = {available.x + (available.width - (x - gap)) / 2, available.y + (available.height - maximum) / 2,
                     x - gap, maximum};
    for (Rect& rect : placed.at) {
        rect.x += placed.bounds.x;
        rect.y += placed.bounds.y;
    }
    return placed;
}

std::vector<Tiling> ways_for_three(const std::array<Cell, 3>& parts) {
    return {{{{parts[0], parts[2]}, {parts[1]}}},
            {{{parts[0]}, {parts[1], parts[2]}}},
            {{{parts[0], parts[1], parts[2]}}},
            {{{parts[0]}, {parts[1]}, {parts[2]}}}};
}

std::vector<Tiling> ways_for_equals(double width, double height, int count) {
    std::vector<Tiling> ways;
    for (int columns = 1; columns <= count; ++columns) {
        const int rows = (count + columns - 1) / columns;
        if (columns > 1 && rows == (count + columns - 2) / (columns - 1)) continue;
        Tiling tiling;
        tiling.columns.resize(columns);
        for (int n = 0; n < count; ++n) tiling.columns[n % columns].push_back({width, height});
        ways.push_back(tiling);
    }
    return ways;
}

Split split(const Rect& available, double aspect, int rim, const std::vector<Tiling>& ways, int gap) {
    Split best;
    bool is_beside = true;
    double maximum = -1;
    for (int way = 0; way < int(ways.size()); ++way)
        for (const bool beside : {true, false})
            for (double fraction = 0.35; fraction < 0.76; fraction += 0.01) {
                Rect view = available, rest = available;
                (beside ? view.width : view.height) = int(fraction * (beside ? available.width : available.height));
                const int used = (beside ? view.width : view.height) + gap;
                (beside ? rest.x : rest.y) += used;
                (beside ? rest.width : rest.height) -= used;
                const Tiling::Placed parts = ways[way].place(rest, gap);
                const double filled = area(parts) / (double(parts.bounds.width) * parts.bounds.height);
                const double score = 0.55 * std::log(fitted(view, aspect, rim)) +
                                     0.45 * std::log(std::max(1.0, area(parts))) + 0.3 * std::log(filled) +
                                     (beside ? 0.03 : 0);
                if (score <= maximum + 1e-9) continue;
                maximum = score;
                best = {view, parts, way};
                is_beside = beside;
            }
    // Moves the parts to the right or lower end of `available`, and enlarges the view by the space that becomes free.
    int& corner = is_beside ? best.parts.bounds.x : best.parts.bounds.y;
    const int moved =
        (is_beside ? available.right() - best.parts.bounds.width : available.bottom() - best.parts.bounds.height) -
        corner;
    corner += moved;
    for (Rect& part : best.parts.at) (is_beside ? part.x : part.y) += moved;
    (is_beside ? best.view.width : best.view.height) = corner - gap - (is_beside ? available.x : available.y);
    return best;
}

Split fill(const Rect& available, const std::vector<Tiling>& ways, int gap) {
    Split best;
    double maximum = -1;
    for (int way = 0; way < int(ways.size()); ++way) {
        const Tiling::Placed parts = ways[way].place(available, gap);
        if (area(parts) <= maximum) continue;
        maximum = area(parts);
        best = {{}, parts, way};
    }
    return best;
}

}  // namespace covol::figure
