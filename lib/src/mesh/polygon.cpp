#include "mesh/polygon.h"

#include <cmath>

#include "base/geometry.h"

namespace covol::meshing {
namespace {

using Corner = std::array<double, 2>;

/// Twice the signed area of a triangle, positive if its corners are counter-clockwise.
double turn(const Corner& a, const Corner& b, const Corner& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Projects the corners along the axis closest to Newell's normal; the result is counter-clockwise. Empty if the normal
/// is 0.
std::vector<Corner> flatten(const std::vector<Vec3>& corners) {
    Vec3 normal{0, 0, 0};
    for (std::size_t n = 1; n + 1 < corners.size(); ++n) {
        const Vec3 part = cross(minus(corners[n], corners[0]), minus(corners[n + 1], corners[0]));
        for (std::size_t a = 0; a < 3; ++a) normal[a] += part[a];
    }
    // The coordinate along the normal's largest component is omitted. Areas keep their sign if the two others are in
    // cyclic order.
    std::size_t out = 0;
    for (std::size_t a = 1; a < 3; ++a)
        if (std::abs(normal[a]) > std::abs(normal[out])) out = a;
    if (!(std::abs(normal[out]) > 0)) return {};
    const std::size_t u = (out + 1) % 3, v = (out + 2) % 3;
    std::vector<Corner> flat;
    for (const Vec3& p : corners)
        flat.push_back(normal[out] > 0 ? Corner{p[u] - corners[0][u], p[v] - corners[0][v]}
                                       : Corner{p[v] - corners[0][v], p[u] - corners[0][u]});
    return flat;
}

std::vector<std::array<std::uint32_t, 3>> fan(std::size_t corners) {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::uint32_t n = 2; n < corners; ++n) triangles.push_back({0, n - 1, n});
    return triangles;
}

/// Ear clipping (Meisters 1975).
class Clipper {
public:
    explicit Clipper(const std::vector<Corner>& flat) : flat_(flat), next_(flat.size()), previous_(flat.size()) {
        for (std::uint32_t n = 0; n < flat.size(); ++n) {
            next_[n] = std::uint32_t((n + 1) % flat.size());
            previous_[n] = std::uint32_t((n + flat.size() - 1) % flat.size());
        }
    }

    std::vector<std::array<std::uint32_t, 3>> cut() {
        std::vector<std::array<std::uint32_t, 3>> triangles;
        std::uint32_t at = 0;
        for (std::size_t left = flat_.size(); left > 3; --left) {
            const std::uint32_t ear = find_ear(at, left);
            triangles.push_back({previous_[ear], ear, next_[ear]});
            next_[previous_[ear]] = next_[ear];
            previous_[next_[ear]] = previous_[ear];
            at = next_[next_[ear]];
        }
        triangles.push_back({previous_[at], at, next_[at]});
        return triangles;
    }

private:
    /// The next ear, from corner `at` on. If there is none, as in a polygon that intersects itself, returns the corner
    /// whose triangle has the largest area.
    std::uint32_t find_ear(std::uint32_t at, std::size_t left) const {
        std::uint32_t best = at;
        double maximum = -INFINITY;
        for (std::size_t n = 0; n < left; ++n, at = next_[at]) {
            const double area = turn(flat_[previous_[at]], flat_[at], flat_[next_[at]]);
            if (area > 0 && is_empty(at)) return at;
            if (area > maximum) {
                maximum = area;
                best = at;
            }
        }
        return best;
    }

    /// Whether no corner lies in the triangle or on its border, except its own corners and others at the same
    /// positions.
    bool is_empty(std::uint32_t ear) const {
        const Corner &a = flat_[previous_[ear]], &b = flat_[ear], &c = flat_[next_[ear]];
        for (std::uint32_t n = next_[next_[ear]]; n != previous_[ear]; n = next_[n]) {
            const Corner& p = flat_[n];
            if (p == a || p == b || p == c) continue;
            if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
        }
        return true;
    }

    const std::vector<Corner>& flat_;
    std::vector<std::uint32_t> next_, previous_;
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> cut_polygon(const std::vector<Vec3>& corners) {
    if (corners.size() < 4) return fan(corners.size());
    const std::vector<Corner> flat = flatten(corners);
    if (flat.empty()) return fan(corners.size());
    bool fans = true;
    for (std::size_t n = 2; fans && n < flat.size(); ++n) fans = turn(flat[0], flat[n - 1], flat[n]) >= 0;
    if (fans) return fan(corners.size());
    if (corners.size() > kMaxPolygonCorners) return {};
    return Clipper(flat).cut();
}

}  // namespace covol::meshing
