// The body between contours: shape-based interpolation of signed distance fields, and domes beyond the end slices.
#include "contours/contour_solid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "covol/contours.h"

namespace covol {

using detail::Polygon;
using detail::PolygonMoments;
using detail::SliceGrid;
using detail::SlicePlace;
using detail::SolidSlice;
using detail::Vec2;

namespace {

/// The dome's profile: the distance by which the body's lateral surface lies inside the last contour at the fraction t
/// of the dome's height. A paraboloid: the area of its sections decreases linearly with the height.
double dome(double radius, double t) { return t < 1 ? radius * (1 - std::sqrt(1 - t)) : radius; }

/// The slope at a node from the secants on both sides, which span `left` and `right`: their weighted harmonic mean, or
/// 0 if their signs differ (Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 1984), so that cubics do not overshoot.
double monotone_slope(double secant_left, double left, double secant_right, double right) {
    if (!(secant_left * secant_right > 0)) return 0;
    const double a = 2 * right + left, b = right + 2 * left;
    return (a + b) / (a / secant_left + b / secant_right);
}

/// Cubic Hermite interpolation at t, 0 to 1, between the values v0 and v1 with the slopes m0 and m1, which are
/// multiplied by the interval's length.
double hermite(double v0, double v1, double m0, double m1, double t) {
    const double s = 1 - t;
    return s * s * ((1 + 2 * t) * v0 + t * m0) + t * t * ((1 + 2 * s) * v1 - s * m1);
}

/// One interval of the body along the slices' normal, with the level inside it.
class Interval {
public:
    enum class Kind { Below, Between, Above };
    /// @param n  index of the slice at the interval's beginning; for a dome, of the end slice on which it stands
    Interval(const ContourSolid::Data& data, Kind kind, std::size_t n) : data_(data), kind_(kind), n_(n) {}

    [[nodiscard]] double begin() const { return kind_ == Kind::Below ? slice().w - slice().cap : slice().w; }
    [[nodiscard]] double end() const {
        return kind_ == Kind::Between ? data_.slices[n_ + 1].w
               : kind_ == Kind::Above ? slice().w + slice().cap
                                      : slice().w;
    }

    [[nodiscard]] double level(double x, double y, double w) const {
        if (is_shifted()) {
            const Vec2& s = slice().shift;
            const double t = (w - slice().w) / (data_.slices[n_ + 1].w - slice().w);
            return (1 - t) * at(slice(), place(x - t * s[0], y - t * s[1])) +
                   t * at(data_.slices[n_ + 1], place(x + (1 - t) * s[0], y + (1 - t) * s[1]));
        }
        return level(column(place(x, y)), w);
    }
    /// Whether w lies in this interval, as in interval_at().
    [[nodiscard]] bool holds(double w) const {
        if (kind_ == Kind::Below) return w < slice().w;
        return slice().w <= w && (kind_ == Kind::Above || w < data_.slices[n_ + 1].w);
    }
    /// Levels at (x, y) for w, which is in this interval, w + dw, w + 2 dw, ... Stops at the end of the interval, or
    /// after `count` values. @return the number of values
    [[nodiscard]] int levels_over(double x, double y, double w, double dw, int count, float* values) const {
        const Column c = is_shifted() ? Column{} : column(place(x, y));
        int n = 0;
        double at = w;
        do values[n] = float(is_shifted() ? level(x, y, at) : level(c, at));
        while (at = w + dw * ++n, n < count && holds(at));
        return n;
    }
    /// Bounds of the level within `radius` of a position of the plane, for all w. Beyond an end slice there is no upper
    /// bound, because the level increases without limit with the height.
    [[nodiscard]] std::array<double, 2> range(double x, double y, double radius) const {
        const SlicePlace p = place(x, y);
        const double here = at(slice(), p);
        if (kind_ != Kind::Between && slice().open) {
            // The level of each section is a distance, so between two positions it differs by at most their distance.
            const double height = slice().end + radius, fraction = height / std::abs(slice().w - inner().w);
            return {std::min(here, carried_on(column(p), height)) - (1 + 2 * fraction) * radius,
                    std::numeric_limits<double>::max()};
        }
        if (kind_ != Kind::Between) return {here - radius, std::numeric_limits<double>::max()};
        const double there = at(data_.slices[n_ + 1], p);
        const double reach = radius + std::hypot(slice().shift[0], slice().shift[1]);
        return {std::min(here, there) - reach, std::max(here, there) + reach};
    }
    /// Appends the surface's points strictly inside the interval: one for each lattice line that it crosses along the
    /// axis closest to its normal. In the frame (x, y, w).
    void append_surface(double step, std::vector<Vec3>& points) const;

private:
    [[nodiscard]] SlicePlace place(double x, double y) const { return place_in(data_.grid, x, y); }
    [[nodiscard]] double at(const SolidSlice& section, const SlicePlace& p) const { return section.at(data_.grid, p); }

    /// The data of the level along w over a position of the plane, if the sections are not shifted.
    struct Column {
        double here, there;  ///< levels of this slice and the next one; for an open end, of the inner neighbour
        double begin, end;   ///< slopes of the level along w at both slices, times their distance
    };
    [[nodiscard]] Column column(const SlicePlace& p) const {
        const double here = at(slice(), p);
        if (kind_ != Kind::Between) return {here, slice().open && !is_apart() ? at(inner(), p) : here, 0, 0};
        const SolidSlice& next = data_.slices[n_ + 1];
        const double length = next.w - slice().w, there = at(next, p), secant = (there - here) / length;
        return {here, there, slope_below(p, here, secant, length) * length,
                slope_above(p, there, secant, length) * length};
    }
    [[nodiscard]] double level(const Column& c, double w) const {
        if (kind_ == Kind::Between)
            return hermite(c.here, c.there, c.begin, c.end, (w - slice().w) / (data_.slices[n_ + 1].w - slice().w));
        const double height = std::abs(w - slice().w);
        return slice().open ? std::max(carried_on(c, height), height - slice().end) : c.here + beyond(height);
    }
    /// The level at a height beyond an open end. If the sections shrink towards the end, the lateral surface is
    /// continued linearly. If they grow, it is continued as a paraboloid, which becomes steeper with the height, with
    /// an outward slope of at most 45 degrees: bodies are usually round, so that a section that grows fast does not
    /// grow indefinitely.
    [[nodiscard]] double carried_on(const Column& c, double height) const {
        const double t = height / std::abs(slice().w - inner().w), change = c.here - c.there;
        return c.here + (change > 0 ? t * change : std::max((std::sqrt(1 + t) - 1) * change, -height));
    }
    /// Slopes of the level along w at the interval's two slices, from the secants on both sides of a slice. Beyond an
    /// end slice, the mean slope of the dome is used instead of a secant.
    [[nodiscard]] double slope_below(const SlicePlace& p, double here, double secant, double length) const {
        if (n_ == 0 && slice().open) return secant;
        if (n_ == 0) return monotone_slope(-slice().depth / slice().cap, slice().cap, secant, length);
        const SolidSlice& before = data_.slices[n_ - 1];
        const double left = slice().w - before.w;
        return monotone_slope((here - at(before, p)) / left, left, secant, length);
    }
    [[nodiscard]] double slope_above(const SlicePlace& p, double there, double secant, double length) const {
        const SolidSlice& next = data_.slices[n_ + 1];
        if (n_ + 2 == data_.slices.size() && next.open) return secant;
        if (n_ + 2 == data_.slices.size()) return monotone_slope(secant, length, next.depth / next.cap, next.cap);
        const SolidSlice& after = data_.slices[n_ + 2];
        const double right = after.w - next.w;
        return monotone_slope(secant, length, (at(after, p) - there) / right, right);
    }
    [[nodiscard]] const SolidSlice& slice() const { return data_.slices[n_]; }
    /// The neighbour of an end slice.
    [[nodiscard]] const SolidSlice& inner() const { return data_.slices[kind_ == Kind::Below ? n_ + 1 : n_ - 1]; }
    /// Whether an end slice's section does not overlap that of its neighbour. If so, the direction of the lateral
    /// surface does not follow from the two sections.
    [[nodiscard]] bool is_apart() const { return kind_ == Kind::Below ? slice().apart : inner().apart; }
    [[nodiscard]] double beyond(double height) const {
        const double cap = slice().cap;
        return dome(slice().depth, height / cap) + std::max(0.0, height - cap);
    }
    [[nodiscard]] bool is_shifted() const { return kind_ == Kind::Between && slice().shift != Vec2{0, 0}; }
    [[nodiscard]] bool may_cross(int i, int j) const;

    const ContourSolid::Data& data_;
    Kind kind_;
    std::size_t n_;
};

/// Whether the surface can cross this interval over the grid's cell between the nodes (i, j) and (i + 1, j + 1). It
/// cannot if the four corners are all inside, or all outside, at both ends of the interval. For shifted sections this
/// is not tested, because the corners of the two slices do not correspond to each other.
bool Interval::may_cross(int i, int j) const {
    if (is_shifted()) return true;
    const SliceGrid& grid = data_.grid;
    bool inside = false, outside = kind_ != Kind::Between && !slice().open;
    for (int dj = 0; dj <= 1; ++dj)
        for (int di = 0; di <= 1; ++di) {
            const std::size_t node = std::size_t(j + dj) * std::size_t(grid.nx) + std::size_t(i + di);
            const bool here = slice().level[node] < 0;
            bool there = kind_ == Kind::Between ? data_.slices[n_ + 1].level[node] < 0 : here;
            if (kind_ != Kind::Between && slice().open)
                there = carried_on(
                            column(place(grid.origin[0] + grid.cell * (i + di), grid.origin[1] + grid.cell * (j + dj))),
                            slice().cap) < 0;
            inside |= here || there;
            outside |= !here || !there;
        }
    return inside && outside;
}

void Interval::append_surface(double step, std::vector<Vec3>& points) const {
    const SliceGrid& grid = data_.grid;
    const int layers = std::max(1, int(std::ceil((end() - begin()) / step)));
    const double dw = (end() - begin()) / layers;
    for (int j = 0; j + 1 < grid.ny; ++j)
        for (int i = 0; i + 1 < grid.nx; ++i) {
            if (!may_cross(i, j)) continue;
            const double x = grid.origin[0] + grid.cell * i, y = grid.origin[1] + grid.cell * j;
            const std::array<std::array<double, 2>, 3> corners{{{x, y}, {x + grid.cell, y}, {x, y + grid.cell}}};
            std::array<Column, 3> columns;
            if (!is_shifted())
                for (int n = 0; n < 3; ++n) columns[n] = column(place(corners[n][0], corners[n][1]));
            const auto level_at = [&](int n, double w) {
                return is_shifted() ? level(corners[n][0], corners[n][1], w) : level(columns[n], w);
            };
            for (int layer = 0; layer < layers; ++layer) {
                const double w = begin() + dw * layer;
                const double here = level_at(0, w);
                const std::array<double, 3> next{level_at(1, w), level_at(2, w), level_at(0, w + dw)};
                if ((next[0] < 0) == (here < 0) && (next[1] < 0) == (here < 0) && (next[2] < 0) == (here < 0)) continue;
                const std::array<double, 3> slope{(next[0] - here) / grid.cell, (next[1] - here) / grid.cell,
                                                  (next[2] - here) / dw};
                int axis = 0;
                for (int a = 1; a < 3; ++a)
                    if (std::abs(slope[a]) > std::abs(slope[axis])) axis = a;
                if ((next[axis] < 0) == (here < 0)) continue;
                Vec3 p{x, y, w};
                // Points on a slice itself are left out, because they are known from its contour.
                if (axis != 2 && layer == 0 && kind_ != Kind::Below) continue;
                p[axis] -= here / slope[axis];
                points.push_back(p);
            }
        }
}

/// The interval that contains w; the domes contain everything beyond the end slices.
Interval interval_at(const ContourSolid::Data& data, double w) {
    const auto above = std::upper_bound(data.slices.begin(), data.slices.end(), w,
                                        [](double value, const SolidSlice& s) { return value < s.w; });
    if (above == data.slices.begin()) return {data, Interval::Kind::Below, 0};
    const auto n = std::size_t(above - data.slices.begin()) - 1;
    return {data, above == data.slices.end() ? Interval::Kind::Above : Interval::Kind::Between, n};
}

std::vector<Interval> intervals(const ContourSolid::Data& data) {
    std::vector<Interval> all{{data, Interval::Kind::Below, 0}};
    for (std::size_t n = 0; n + 1 < data.slices.size(); ++n) all.emplace_back(data, Interval::Kind::Between, n);
    all.emplace_back(data, Interval::Kind::Above, data.slices.size() - 1);
    return all;
}

/// The deepest node of each part of the outside that is not connected to the grid's border.
std::vector<Vec2> deepest_in_holes(const std::vector<float>& level, const SliceGrid& grid) {
    std::vector<char> seen(level.size(), 0);
    std::vector<std::size_t> stack;
    std::vector<Vec2> found;
    const auto flood = [&](std::size_t from) {
        std::size_t deepest = from;
        bool at_border = false;
        stack.assign(1, from);
        seen[from] = 1;
        while (!stack.empty()) {
            const std::size_t node = stack.back();
            stack.pop_back();
            if (level[node] > level[deepest]) deepest = node;
            const auto i = int(node % std::size_t(grid.nx)), j = int(node / std::size_t(grid.nx));
            if (i == 0 || j == 0 || i == grid.nx - 1 || j == grid.ny - 1) {
                at_border = true;
                continue;  // the part is known to be connected to the border
            }
            for (const std::ptrdiff_t to :
                 {std::ptrdiff_t(-1), std::ptrdiff_t(1), -std::ptrdiff_t(grid.nx), std::ptrdiff_t(grid.nx)}) {
                const auto other = std::size_t(std::ptrdiff_t(node) + to);
                if (seen[other] || level[other] < 0) continue;
                seen[other] = 1;
                stack.push_back(other);
            }
        }
        if (!at_border)
            found.push_back({grid.origin[0] + grid.cell * double(deepest % std::size_t(grid.nx)),
                             grid.origin[1] + grid.cell * double(deepest / std::size_t(grid.nx))});
    };
    for (std::size_t node = 0; node < level.size(); ++node)
        if (!seen[node] && level[node] >= 0) flood(node);
    return found;
}

}  // namespace

double compute_cap_height(double area, double before, double distance, double gap) {
    return before > area ? std::min(gap, distance * area / (before - area)) : gap;
}

ContourSolid::ContourSolid(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

double ContourSolid::level(const Vec3& world) const {
    const Vec3 p = data_->frame.from_world(world);
    return interval_at(*data_, p[2]).level(p[0], p[1], p[2]);
}

void ContourSolid::levels(const Vec3& first, const Vec3& step, int count, float* values) const {
    const Vec3 p = data_->frame.from_world(first);
    const Vec3 next = data_->frame.from_world({first[0] + step[0], first[1] + step[1], first[2] + step[2]});
    const Vec3 d{next[0] - p[0], next[1] - p[1], next[2] - p[2]};
    // Along the slices' normal one column is valid for all positions in its interval.
    const bool along_w = d[0] == 0 && d[1] == 0;
    for (int n = 0; n < count;) {
        const double x = p[0] + n * d[0], y = p[1] + n * d[1], w = p[2] + n * d[2];
        n += interval_at(*data_, w).levels_over(x, y, w, d[2], along_w ? count - n : 1, values + n);
    }
}

bool ContourSolid::may_meet(const Vec3& center, double radius) const {
    const Vec3 p = data_->frame.from_world(center);
    double low = std::numeric_limits<double>::max(), high = -low;
    const auto include = [&](const Interval& interval) {
        const auto [minimum, maximum] = interval.range(p[0], p[1], radius);
        low = std::min(low, minimum);
        high = std::max(high, maximum);
    };
    const auto& slices = data_->slices;
    if (p[2] + radius < slices.front().w - slices.front().highest() ||
        p[2] - radius > slices.back().w + slices.back().highest())
        return false;
    include(interval_at(*data_, p[2] - radius));
    auto above = std::upper_bound(slices.begin(), slices.end(), p[2] - radius,
                                  [](double value, const SolidSlice& s) { return value < s.w; });
    for (; above != slices.end() && above->w < p[2] + radius; ++above) include(interval_at(*data_, above->w));
    return low < 0 && high >= 0;
}

WorldBox ContourSolid::box() const {
    const SliceGrid& grid = data_->grid;
    const auto& slices = data_->slices;
    std::vector<Vec3> corners;
    // Beyond an open end slice, the lateral surface slopes outward by at most 45 degrees, so the body extends sideways
    // beyond the grid by at most the height of its continuation.
    double wider = 0;
    for (const SolidSlice* end : {&slices.front(), &slices.back()})
        if (end->open) wider = std::max(wider, end->end);
    for (const double x : {grid.origin[0] - wider, grid.origin[0] + grid.cell * (grid.nx - 1) + wider})
        for (const double y : {grid.origin[1] - wider, grid.origin[1] + grid.cell * (grid.ny - 1) + wider})
            for (const double w :
                 {slices.front().w - slices.front().highest(), slices.back().w + slices.back().highest()})
                corners.push_back(data_->frame.to_world({x, y, w}));
    return bounding_box(corners);
}

std::vector<Vec3> ContourSolid::surface_points(double step, const RunContext& run) const {
    std::vector<Vec3> points;
    with_threads(run, [&] {
        const std::vector<Interval> all = intervals(*data_);
        std::vector<std::vector<Vec3>> parts(all.size());
        tbb::parallel_for(std::size_t(0), all.size(), [&](std::size_t n) { all[n].append_surface(step, parts[n]); });
        for (const std::vector<Vec3>& part : parts)
            for (const Vec3& p : part) points.push_back(data_->frame.to_world(p));
    });
    run.check();
    return points;
}

std::vector<Vec3> ContourSolid::hole_seeds() const {
    std::vector<std::vector<Vec2>> parts(data_->slices.size());
    tbb::parallel_for(std::size_t(0), parts.size(), [&](std::size_t n) {
        // A single contour without self-intersections has no hole.
        if (data_->slices[n].polygons > 1) parts[n] = deepest_in_holes(data_->slices[n].level, data_->grid);
    });
    std::vector<Vec3> seeds;
    for (std::size_t n = 0; n < parts.size(); ++n)
        for (const Vec2& p : parts[n]) seeds.push_back(data_->frame.to_world({p[0], p[1], data_->slices[n].w}));
    return seeds;
}

}  // namespace covol
