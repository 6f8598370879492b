#include "painted/outline.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "painted/heuristics.h"

namespace covol::painted {
namespace {

using detail::Polygon;
using detail::Vec2;

/// The weights of the value at 0 of the least-squares quadratic through values at -n..n.
std::vector<double> quadratic_weights(int n) {
    // With S0 = sum 1, S2 = sum t^2, S4 = sum t^4 they are (S4 - S2 t^2) / (S0 S4 - S2^2).
    double s0 = 0, s2 = 0, s4 = 0;
    for (int t = -n; t <= n; ++t) {
        s0 += 1;
        s2 += double(t) * t;
        s4 += double(t) * t * t * t;
    }
    std::vector<double> weights;
    for (int t = -n; t <= n; ++t) weights.push_back((s4 - s2 * t * t) / (s0 * s4 - s2 * s2));
    return weights;
}

/// Traces the lines between voxels inside and outside, through the midpoints between neighbouring voxels' centres.
class Walk {
public:
    explicit Walk(const Slice& slice) : slice_(slice), seen_(2 * nodes(), 0) {}

    std::vector<Polygon> go() {
        std::vector<Polygon> lines;
        // Every line passes between some voxel inside and its lower neighbour along i that is outside.
        for (int j = 0; j < slice_.ny; ++j)
            for (int i = 0; i < slice_.nx; ++i)
                if (slice_.at(i, j) && !slice_.at(i - 1, j) && !seen_[id({i, j}, {-1, 0})])
                    lines.push_back(follow({i, j}, {-1, 0}));
        return lines;
    }

private:
    using Step = std::array<int, 2>;

    [[nodiscard]] std::size_t nodes() const { return std::size_t(slice_.nx + 1) * std::size_t(slice_.ny + 1); }
    /// The index of the edge between voxel p and its neighbour p + to.
    [[nodiscard]] std::size_t id(const Step& p, const Step& to) const {
        const int i = p[0] + std::max(to[0], 0), j = p[1] + std::max(to[1], 0);
        return (std::size_t(j) * std::size_t(slice_.nx + 1) + std::size_t(i)) * 2 + (to[0] != 0 ? 0 : 1);
    }
    [[nodiscard]] bool inside(const Step& p) const { return slice_.at(p[0], p[1]); }

    /// Traces a line around the inside, counter-clockwise; `p` is inside, its neighbour along `out` is not.
    Polygon follow(Step p, Step out) {
        Polygon line;
        while (!seen_[id(p, out)]) {
            seen_[id(p, out)] = 1;
            line.push_back({p[0] + 0.5 * out[0], p[1] + 0.5 * out[1]});
            const Step ahead{-out[1], out[0]};
            const Step next{p[0] + ahead[0], p[1] + ahead[1]}, corner{next[0] + out[0], next[1] + out[1]};
            if (!inside(next)) {
                out = ahead;  // turn around this voxel; one that touches it only at the corner is separate
            } else if (inside(corner)) {
                p = corner;
                out = {-ahead[0], -ahead[1]};
            } else {
                p = next;
            }
        }
        return line;
    }

    const Slice& slice_;
    std::vector<std::uint8_t> seen_;
};

/// The slice, extended by `by` voxels beyond each end of the image that it reaches; the outermost voxels are repeated
/// there.
Slice grown(const Slice& slice, const std::array<bool, 4>& ends, int by) {
    const int left = ends[0] ? by : 0, right = ends[1] ? by : 0, low = ends[2] ? by : 0, high = ends[3] ? by : 0;
    Slice wide;
    wide.nx = slice.nx + left + right;
    wide.ny = slice.ny + low + high;
    wide.inside.resize(std::size_t(wide.nx) * std::size_t(wide.ny));
    for (int j = 0; j < wide.ny; ++j)
        for (int i = 0; i < wide.nx; ++i)
            wide.inside[std::size_t(j) * std::size_t(wide.nx) + std::size_t(i)] =
                slice.at(std::clamp(i - left, 0, slice.nx - 1), std::clamp(j - low, 0, slice.ny - 1)) ? 1 : 0;
    return wide;
}

/// Chessboard distance of each voxel to the nearest voxel outside, in two passes.
std::vector<int> depths(const Slice& slice) {
    std::vector<int> depth(slice.inside.size(), 0);
    const auto value = [&](int i, int j) {
        return slice.at(i, j) ? depth[std::size_t(j) * std::size_t(slice.nx) + std::size_t(i)] : 0;
    };
    const auto pass = [&](int sign) {
        for (int b = 0; b < slice.ny; ++b)
            for (int a = 0; a < slice.nx; ++a) {
                const int i = sign > 0 ? a : slice.nx - 1 - a, j = sign > 0 ? b : slice.ny - 1 - b;
                if (!slice.at(i, j)) continue;
                const int before =
                    std::min({value(i - sign, j), value(i - 1, j - sign), value(i, j - sign), value(i + 1, j - sign)}) +
                    1;
                int& own = depth[std::size_t(j) * std::size_t(slice.nx) + std::size_t(i)];
                own = sign > 0 ? before : std::min(own, before);
            }
    };
    pass(1);
    pass(-1);
    return depth;
}

/// The width of a patch, and whether it is a stroke (thin and long), from the depths of its voxels: their distances
/// from the patch's border. @param deepest  the largest depth; @param sum  of all depths
Patch classified(std::size_t area, int deepest, double sum) {
    Patch patch;
    patch.area = area;
    // The depths across bands of 1, 2, 3 and 4 voxels are 1; 1 1; 1 2 1; 1 2 2 1. Widths of 3 and 4 have the same
    // maximum and are distinguished by the mean, 4/3 or 3/2.
    const double mean = sum / double(area);
    const bool even = deepest == 2 && mean > (4.0 / 3.0 + 3.0 / 2.0) / 2;
    patch.width = 2 * deepest - (even ? 0 : 1);
    const double band = deepest == 1 ? 1.5 : patch.width;
    patch.stroke = patch.width <= kOutline.widest_stroke && double(area) >= kOutline.stroke_length * band * band;
    return patch;
}

}  // namespace

std::vector<Polygon> pixel_outlines(const Slice& slice) { return Walk(slice).go(); }

Polygon smoothed(const Polygon& outline) {
    const int count = int(outline.size());
    const int n = std::min(kOutline.window, int(kOutline.window_of_line * count));
    if (n < 2) return outline;  // a quadratic through three values would change nothing
    const std::vector<double> weights = quadratic_weights(n);
    Polygon line(outline.size());
    for (int v = 0; v < count; ++v) {
        Vec2 mean{0, 0};
        for (int t = -n; t <= n; ++t) {
            const Vec2& p = outline[std::size_t((v + t + count) % count)];
            for (int a = 0; a < 2; ++a) mean[a] += weights[std::size_t(t + n)] * p[a];
        }
        const Vec2& old = outline[std::size_t(v)];
        for (int a = 0; a < 2; ++a)
            // The line must not pass the centres of the voxels beside it, which are half a voxel away.
            line[std::size_t(v)][a] = std::clamp(mean[a], old[a] - 0.5, old[a] + 0.5);
    }
    return line;
}

std::vector<Polygon> outlines(const Slice& slice, const std::array<bool, 4>& ends) {
    const int by = 2 * kOutline.window;
    std::vector<Polygon> lines;
    for (const Polygon& outline : pixel_outlines(grown(slice, ends, by))) {
        Polygon line = smoothed(outline);
        for (Vec2& p : line) {
            p[0] -= ends[0] ? by : 0;
            p[1] -= ends[2] ? by : 0;
            if (ends[0]) p[0] = std::max(p[0], -0.5);
            if (ends[1]) p[0] = std::min(p[0], slice.nx - 0.5);
            if (ends[2]) p[1] = std::max(p[1], -0.5);
            if (ends[3]) p[1] = std::min(p[1], slice.ny - 0.5);
        }
        line.erase(std::unique(line.begin(), line.end()), line.end());
        while (line.size() > 1 && line.front() == line.back()) line.pop_back();
        if (line.size() >= 3) lines.push_back(std::move(line));
    }
    return lines;
}

std::vector<Patch> patches(const Slice& slice) {
    const std::vector<int> depth = depths(slice);
    std::vector<std::uint8_t> seen(slice.inside.size(), 0);
    std::vector<Patch> found;
    std::vector<std::array<int, 2>> stack;
    for (int j = 0; j < slice.ny; ++j)
        for (int i = 0; i < slice.nx; ++i) {
            const auto index = [&](int x, int y) { return std::size_t(y) * std::size_t(slice.nx) + std::size_t(x); };
            if (!slice.at(i, j) || seen[index(i, j)]) continue;
            std::size_t area = 0;
            int deepest = 0;
            double sum = 0;
            seen[index(i, j)] = 1;
            stack.push_back({i, j});
            while (!stack.empty()) {
                const auto [x, y] = stack.back();
                stack.pop_back();
                ++area;
                deepest = std::max(deepest, depth[index(x, y)]);
                sum += depth[index(x, y)];
                for (int dy = -1; dy <= 1; ++dy)
                    for (int dx = -1; dx <= 1; ++dx)
                        if (slice.at(x + dx, y + dy) && !seen[index(x + dx, y + dy)]) {
                            seen[index(x + dx, y + dy)] = 1;
                            stack.push_back({x + dx, y + dy});
                        }
            }
            found.push_back(classified(area, deepest, sum));
        }
    return found;
}

}  // namespace covol::painted
