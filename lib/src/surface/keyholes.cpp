#include "surface/keyholes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace covol::detail {
namespace {

using Curve = std::vector<PlanePoint>;

double area_of(const Curve& curve) {
    double twice = 0;
    for (std::size_t n = 0; n < curve.size(); ++n) {
        const PlanePoint &a = curve[n], &b = curve[(n + 1) % curve.size()];
        twice += a[0] * b[1] - b[0] * a[1];
    }
    return twice / 2;
}

/// Whether the curve encloses the point, by the even-odd rule.
bool encloses(const Curve& curve, const PlanePoint& p) {
    bool inside = false;
    for (std::size_t n = 0; n < curve.size(); ++n) {
        const PlanePoint &a = curve[n], &b = curve[(n + 1) % curve.size()];
        if ((a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]))
            inside = !inside;
    }
    return inside;
}

/// A hole that is not connected yet: its squared shortest distance to the connected curves, the index of its own
/// nearest point, and the other curve's nearest point.
struct Waiting {
    Curve curve;
    double square = std::numeric_limits<double>::max();
    std::size_t own = 0;
    PlanePoint other{};

    void update_nearest(const Curve& joined) {
        for (std::size_t n = 0; n < curve.size(); ++n)
            for (const PlanePoint& p : joined) {
                const double x = p[0] - curve[n][0], y = p[1] - curve[n][1];
                if (x * x + y * y >= square) continue;
                square = x * x + y * y;
                own = n;
                other = p;
            }
    }
};

/// Connects the holes to the part, the nearest first: no other hole can lie in its channel, because that hole would be
/// nearer.
Curve with_holes(Curve part, std::vector<Waiting> holes) {
    for (Waiting& hole : holes) hole.update_nearest(part);
    while (!holes.empty()) {
        const auto next = std::min_element(holes.begin(), holes.end(),
                                           [](const Waiting& a, const Waiting& b) { return a.square < b.square; });
        const Waiting hole = std::move(*next);
        holes.erase(next);
        Curve way{hole.other};
        for (std::size_t n = 0; n <= hole.curve.size(); ++n)
            way.push_back(hole.curve[(hole.own + n) % hole.curve.size()]);
        part.insert(std::find(part.begin(), part.end(), hole.other), way.begin(), way.end());
        for (Waiting& other : holes) other.update_nearest(hole.curve);
    }
    return part;
}

}  // namespace

std::vector<Curve> join_holes(std::vector<Curve> curves) {
    std::vector<Curve> parts, holes;
    for (Curve& curve : curves) (area_of(curve) > 0 ? parts : holes).push_back(std::move(curve));
    std::vector<std::vector<Waiting>> holes_of(parts.size());
    for (Curve& hole : holes) {
        // Finds the smallest part that contains the hole.
        std::size_t best = parts.size();
        for (std::size_t n = 0; n < parts.size(); ++n)
            if (encloses(parts[n], hole.front()) && (best == parts.size() || area_of(parts[n]) < area_of(parts[best])))
                best = n;
        if (best < parts.size()) holes_of[best].push_back({std::move(hole)});
    }
    for (std::size_t n = 0; n < parts.size(); ++n) parts[n] = with_holes(std::move(parts[n]), std::move(holes_of[n]));
    return parts;
}

}  // namespace covol::detail
