#include "cloud/surface/crease.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "base/geometry.h"
#include "cloud/surface/sharp_mesh.h"
#include "covol/mesh.h"
#include "covol/mesh_cleanup.h"
#include "covol/surface.h"

using namespace covol;
using namespace covol::cloud;

namespace {

/// Signed distance to the border of a solid, > 0 outside. Points are drawn from its zero set within the unit ball.
using Solid = std::function<double(const Vec3&)>;

Vec3 gradient(const Solid& f, const Vec3& p, double step) {
    Vec3 g{};
    for (std::size_t a = 0; a < 3; ++a) {
        Vec3 low = p, high = p;
        low[a] -= step;
        high[a] += step;
        g[a] = (f(high) - f(low)) / (2 * step);
    }
    return unit(g);
}

/// Random points on the border of a solid, within the neighbourhood of radius 1 in which fit_crease() seeks a crease.
/// Their normals are averaged over a radius of 0.2, because the normals of an indicator are blurred, too.
std::vector<CreasePoint> border(const Solid& f, double noise, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-1, 1);
    std::normal_distribution<double> error(0, noise);
    std::vector<CreasePoint> points;
    while (points.size() < 60) {
        Vec3 p{place(random), place(random), place(random)};
        if (std::abs(f(p)) > 0.02) continue;
        for (int step = 0; step < 5; ++step) p = plus(p, -f(p), gradient(f, p, 1e-6));
        const double near = 1 - dot(p, p);
        if (std::abs(f(p)) > 1e-9 || !(near > 0)) continue;
        const Vec3 normal = gradient(f, p, 0.2);
        if (noise > 0)
            for (double& x : p) x += error(random);
        points.push_back({p, normal, near * near});
    }
    return points;
}

const Solid kHalf = [](const Vec3& p) { return p[0]; };
Solid half_space(Vec3 normal, double at) {
    return [normal = unit(normal), at](const Vec3& p) { return dot(p, normal) - at; };
}
Solid intersection(Solid a, Solid b) {
    return [=](const Vec3& p) { return std::max(a(p), b(p)); };
}
Solid union_of(Solid a, Solid b) {
    return [=](const Vec3& p) { return std::min(a(p), b(p)); };
}

/// The maximum error of the crease's distance at positions near the border and within 0.8 radii of the origin.
double max_error(const Crease& crease, const Solid& f) {
    double error = 0;
    for (double x = -0.8; x <= 0.8; x += 0.1)
        for (double y = -0.8; y <= 0.8; y += 0.1)
            for (double z = -0.8; z <= 0.8; z += 0.1)
                if (const Vec3 p{x, y, z}; dot(p, p) < 0.64 && std::abs(f(p)) < 0.2)
                    error = std::max(error, std::abs(crease.distance(p) - f(p)));
    return error;
}

}  // namespace

TEST_CASE("fit_crease: edges, grooves and corners of every kind are found in exact points") {
    const Solid a = half_space({1, 0.2, 0}, 0.1), b = half_space({-0.1, 1, 0.3}, 0.05),
                c = half_space({0.1, -0.2, 1}, 0.08);
    const struct {
        const char* name;
        Solid f;
        std::size_t sheets;
    } kinds[] = {{"edge", intersection(a, b), 2},
                 {"groove", union_of(a, b), 2},
                 {"corner", intersection(a, intersection(b, c)), 3},
                 {"inner corner", union_of(a, union_of(b, c)), 3},
                 {"two convex edges and a groove", intersection(a, union_of(b, c)), 3},
                 {"two grooves and a convex edge", union_of(a, intersection(b, c)), 3}};
    for (const auto& kind : kinds) {
        int found = 0;
        for (unsigned seed = 1; seed <= 20; ++seed) {
            const std::optional<Crease> crease = fit_crease(border(kind.f, 0, seed), {0, 0, 0}, 1);
            INFO(kind.name << ", draw " << seed);
            if (!crease || crease->count != kind.sheets) continue;
            ++found;
            CHECK(max_error(*crease, kind.f) < 0.02);
        }
        INFO(kind.name << ": " << found << " of 20");
        // With three sheets, some of the draws have too few points on one of them.
        CHECK(found >= (kind.sheets == 2 ? 19 : 14));
    }
}

TEST_CASE("fit_crease: the crease between a cylinder and its end is accurate to 0.05 radii") {
    const Solid wall = [](const Vec3& p) { return std::hypot(p[0] + 3, p[1]) - 3; };
    const Solid cylinder = intersection(wall, half_space({0, 0, 1}, 0.1));
    double error = 0;
    for (unsigned seed = 1; seed <= 10; ++seed) {
        const std::optional<Crease> crease = fit_crease(border(cylinder, 0, seed), {0, 0, 0}, 1);
        REQUIRE(crease);
        error = std::max(error, max_error(*crease, cylinder));
    }
    INFO(error);
    CHECK(error < 0.05);
}

TEST_CASE("fit_crease: smooth surfaces, with or without noise, have no crease") {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        const Solid ball = [](const Vec3& p) { return length(plus(p, Vec3{1.5, 0, 0})) - 1.5; };
        const Solid saddle = [](const Vec3& p) { return p[0] - 0.3 * p[1] * p[1] + 0.3 * p[2] * p[2]; };
        CHECK_FALSE(fit_crease(border(kHalf, 0, seed), {0, 0, 0}, 1));
        CHECK_FALSE(fit_crease(border(ball, 0, seed), {0, 0, 0}, 1));
        CHECK_FALSE(fit_crease(border(saddle, 0, seed), {0, 0, 0}, 1));
        CHECK_FALSE(fit_crease(border(kHalf, 0.1, seed), {0, 0, 0}, 1));
        CHECK_FALSE(fit_crease(border(ball, 0.1, seed), {0, 0, 0}, 1));
    }
    CHECK_FALSE(fit_crease({}, {0, 0, 0}, 1));
}

TEST_CASE("sharpen: bevels of marching cubes become edges and corners of a box without self-intersections") {
    const Vec3 turn = unit({1, 0.3, 0.2}), side = unit(cross(turn, Vec3{0, 0, 1})), up = cross(turn, side);
    const std::array<Vec3, 3> axes{turn, side, up};
    constexpr double kHalfEdge = 6;
    const auto box = [&](const Vec3& p) {
        double d = -1e9;
        for (const Vec3& axis : axes) d = std::max(d, std::abs(dot(p, axis)) - kHalfEdge);
        return d;
    };
    Domain domain;
    domain.min = {-14, -14, -14};
    domain.max = {14, 14, 14};
    const FloatGridPtr grid = make_grid(domain, 3.0F, "u");
    auto at = grid->getAccessor();
    for (int i = -14; i <= 14; ++i)
        for (int j = -14; j <= 14; ++j)
            for (int k = -14; k <= 14; ++k)
                at.setValue({i, j, k}, float(std::clamp(box({double(i), double(j), double(k)}), -3.0, 3.0)));
    TriangleMesh mesh = extract_mesh(*extract_surface(*grid));
    // The maximum distance of a corner of the box from the nearest vertex of the mesh.
    const auto off_corners = [&] {
        double maximum = 0;
        for (int n = 0; n < 8; ++n) {
            Vec3 corner{0, 0, 0};
            for (std::size_t a = 0; a < 3; ++a)
                corner = plus(corner, (n >> a & 1) != 0 ? kHalfEdge : -kHalfEdge, axes[a]);
            double nearest = 1e9;
            for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
                nearest = std::min(nearest, length(minus(mesh.place(v), corner)));
            maximum = std::max(maximum, nearest);
        }
        return maximum;
    };
    CHECK(off_corners() > 0.1);
    std::vector<Quadric> quadrics;
    for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
            for (int k = -1; k <= 1; ++k) {
                Crease crease;
                Vec3 foot{0, 0, 0};
                const int signs[3] = {i, j, k};
                for (std::size_t a = 0; a < 3; ++a) {
                    if (signs[a] == 0) continue;
                    const Vec3 to_face = times(signs[a] * kHalfEdge, axes[a]);
                    foot = plus(foot, to_face);
                    crease.sheets[crease.count++] = {to_face, frame_of(times(signs[a], axes[a])), {}};
                }
                if (crease.count < 2) continue;
                Quadric q;
                q.origin = foot;
                q.axes = frame_of(crease.mean_normal());
                q.c = {};
                q.crease = std::make_shared<const Crease>(crease);
                quadrics.push_back(q);
            }
    const Creases creases(quadrics, std::vector<double>(quadrics.size(), 7.0));
    CHECK(sharpen(mesh, creases, 1) > 50);
    CHECK(off_corners() < 1e-4);
    const MeshMeasures m = measure(mesh);
    CHECK((m.closed && m.manifold && m.genus == 0 && m.components == 1));
    CHECK(std::abs(m.volume / std::pow(2 * kHalfEdge, 3) - 1) < 1e-4);
    CHECK(count_self_intersections(mesh) == 0);
}
