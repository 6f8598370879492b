// Tests of the surface step: distances to the zero level set, fog, label images.
#include "covol/surface.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "covol/error.h"
#include "redistance/interface_patches.h"
#include "redistance/patch_kernel.h"
#include "support/clouds.h"

using namespace covol;
using namespace covol::test;
using openvdb::Coord;

namespace {

const Domain kDomain = make_domain({{-8, -8, -8}, {8, 8, 8}}, 0.5);
constexpr double kH = 0.5, kHalfWidth = 3 * kH;

openvdb::CoordBBox box_of(const Domain& d) { return {{d.min[0], d.min[1], d.min[2]}, {d.max[0], d.max[1], d.max[2]}}; }

FloatGridPtr field(const Domain& domain, const std::function<double(const Vec3&)>& value) {
    FloatGridPtr u = make_grid(domain, 10.0F, "u");
    for (auto at = box_of(domain).begin(); at; ++at) u->tree().setValue(*at, float(value(world_of(domain, *at))));
    return u;
}

/// A field of waves of about six voxels. Its zero level set has sheets, necks and separate pieces.
FloatGridPtr waves(const Domain& domain, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> phase(0, 6.28);
    double p[6];
    for (double& x : p) x = phase(random);
    return field(domain, [&](const Vec3& x) {
        return std::sin(2.1 * x[0] + p[0]) * std::cos(1.7 * x[1] + p[1]) +
               std::sin(1.9 * x[1] + p[2]) * std::cos(2.3 * x[2] + p[3]) +
               std::sin(2.0 * x[2] + p[4]) * std::cos(1.8 * x[0] + p[5]) - 0.3;
    });
}

struct Point {
    double x, y, z;
    Point operator-(const Point& o) const { return {x - o.x, y - o.y, z - o.z}; }
    Point operator+(const Point& o) const { return {x + o.x, y + o.y, z + o.z}; }
    Point operator*(double s) const { return {s * x, s * y, s * z}; }
    [[nodiscard]] double dot(const Point& o) const { return x * o.x + y * o.y + z * o.z; }
};

/// Squared distance to a triangle, by its Voronoi regions: vertices, edges, face (Ericson, Real-Time Collision
/// Detection, 5.1.5).
double to_triangle(const Point& p, const Point& a, const Point& b, const Point& c) {
    const auto square = [&](const Point& q) { return (p - q).dot(p - q); };
    const Point ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d1 <= 0 && d2 <= 0) return square(a);
    if (d3 >= 0 && d4 <= d3) return square(b);
    if (d6 >= 0 && d5 <= d6) return square(c);
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return square(a + ab * (d1 / (d1 - d3)));
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return square(a + ac * (d2 / (d2 - d6)));
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return square(b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))));
    return square(a + ab * (vb / (va + vb + vc)) + ac * (vc / (va + vb + vc)));
}

/// Distance in voxels to the nearest of all triangles of the patches.
double nearest_by_search(const detail::InterfacePatches& patches, const Coord& at) {
    double best = 1e9;
    for (const detail::Patch& patch : patches.patches) {
        const Point p{double(at[0] - patch.origin[0]), double(at[1] - patch.origin[1]),
                      double(at[2] - patch.origin[2])};
        const auto vertex = [&](std::uint32_t n) {
            const auto& v = patches.vertices[patch.first + n % patch.count];
            return Point{v[0], v[1], v[2]};
        };
        const Point center{patch.center[0], patch.center[1], patch.center[2]};
        if ((p - center).dot(p - center) > 25 + best) continue;
        for (std::uint32_t n = 0; n < patch.count; ++n)
            best = std::min(best, to_triangle(p, center, vertex(n), vertex(n + 1)));
    }
    return std::sqrt(best);
}

}  // namespace

TEST_CASE("The surface of a plane is its exact distance although u has a slope of 5") {
    const Vec3 n{0.48, 0.6, 0.64};
    const auto distance = [&](const Vec3& x) { return n[0] * x[0] + n[1] * x[1] + n[2] * x[2] - 0.3; };
    const FloatGridPtr grid = extract_surface(*field(kDomain, [&](const Vec3& x) { return 5 * distance(x); }));
    CHECK(grid->getGridClass() == openvdb::GRID_LEVEL_SET);
    CHECK(grid->getName() == "surface");
    CHECK(grid->background() == float(kHalfWidth));
    CHECK(domain_of(*grid) == kDomain);
    openvdb::CoordBBox inner = box_of(kDomain);
    inner.expand(-8);  // the domain's end is left out, because the solid is closed there
    double worst = 0;
    for (auto at = inner.begin(); at; ++at) {
        const double exact = std::clamp(distance(world_of(kDomain, *at)), -kHalfWidth, kHalfWidth);
        worst = std::max(worst, std::abs(exact - grid->tree().getValue(*at)));
    }
    CHECK(worst < 1e-5);
}

TEST_CASE("Distances are those to the nearest of all patches, except for less than one voxel in a thousand") {
    double worst = 0;
    int voxels = 0, off = 0;
    for (unsigned seed = 1; seed <= 3; ++seed) {
        const Domain domain = make_domain({{-5, -5, -5}, {5, 5, 5}}, kH);
        const FloatGridPtr u = waves(domain, seed), grid = extract_surface(*u);
        const auto patches = detail::find_interface(*u, domain, detail::DomainEnd::Closed, {});
        for (auto value = grid->cbeginValueOn(); value; ++value) {
            const double exact = nearest_by_search(patches, value.getCoord()), got = std::abs(*value) / kH;
            ++voxels;
            off += got > exact + 1e-4;
            worst = std::max(worst, got - exact);
            REQUIRE(got > exact - 5e-4);
        }
        for (auto at = box_of(domain).begin(); at; ++at)
            REQUIRE((grid->tree().getValue(*at) < 0) == (u->tree().getValue(*at) < 0));
    }
    CHECK(voxels > 20000);
    // Propagation from neighbour to neighbour may miss the nearest patch where sheets meet.
    CHECK(off < voxels / 1000);
    CHECK(worst < 0.05);
}

TEST_CASE("Distances to a patch for eight voxels at a time equal those for single voxels and the exact ones") {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> unit(-0.5F, 0.5F);
    int reached = 0;
    for (int n = 0; n < 200; ++n) {
        std::array<std::array<float, 3>, 5> ring{};
        std::array<float, 3> center{}, axis{unit(random), unit(random), unit(random)};
        const float length = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
        for (float& a : axis) a /= length;
        // Two directions perpendicular to the axis.
        const std::size_t minimum = std::abs(axis[0]) < 0.6F ? 0 : 1;
        std::array<float, 3> e{}, f{};
        for (std::size_t a = 0; a < 3; ++a) e[a] = (a == minimum ? 1.0F : 0.0F) - axis[minimum] * axis[a];
        const float scale = 1 / std::sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
        for (float& a : e) a *= scale;
        for (std::size_t a = 0; a < 3; ++a)
            f[a] = axis[(a + 1) % 3] * e[(a + 2) % 3] - axis[(a + 2) % 3] * e[(a + 1) % 3];
        for (std::size_t v = 0; v < ring.size(); ++v)
            for (std::size_t a = 0; a < 3; ++a)
                ring[v][a] = 0.6F * (std::cos(1.2566F * float(v)) * e[a] + std::sin(1.2566F * float(v)) * f[a]) +
                             0.2F * unit(random);
        for (const auto& v : ring)
            for (std::size_t a = 0; a < 3; ++a) center[a] += v[a] / 5;
        const detail::PatchOutline outline{axis.data(), center.data(), ring.data(), 5};
        detail::PatchFan fan(outline);
        detail::PatchCylinder cylinder{
            {3.4F + unit(random), 3.6F + unit(random), 3.3F + unit(random)}, 1.0F, 3.0F, 0, 0};
        for (const auto& v : ring) {
            float along = 0, all = 0;
            for (std::size_t a = 0; a < 3; ++a) along += axis[a] * (v[a] - center[a]);
            for (std::size_t a = 0; a < 3; ++a) all += (v[a] - center[a]) * (v[a] - center[a]);
            cylinder.patch_height = std::max(cylinder.patch_height, std::abs(along));
            cylinder.patch_radius = std::max(cylinder.patch_radius, std::sqrt(all - along * along));
        }
        std::vector<float> squared(512, 9.0F);
        std::vector<std::int32_t> patch(512, -1);
        std::vector<std::uint64_t> interior(8, 0);
        detail::offer_patch(outline, cylinder, 7, {squared.data(), patch.data(), interior.data()}, fan);
        for (int p = 0; p < 512; ++p) {
            const float arm[3] = {float(p >> 6) - cylinder.center[0], float(p >> 3 & 7) - cylinder.center[1],
                                  float(p & 7) - cylinder.center[2]};
            double exact = 1e9;
            const Point at{arm[0], arm[1], arm[2]};
            for (std::size_t v = 0; v < 5; ++v) {
                const auto from_center = [&](std::size_t w) {
                    return Point{ring[w % 5][0] - center[0], ring[w % 5][1] - center[1], ring[w % 5][2] - center[2]};
                };
                exact = std::min(exact, to_triangle(at, {0, 0, 0}, from_center(v), from_center(v + 1)));
            }
            const detail::PatchHit hit = detail::nearest_on(fan, arm);
            REQUIRE(std::sqrt(hit.squared) == Approx(std::sqrt(exact)).margin(1e-4));
            const bool is_over_patch = std::sqrt(exact) < 2.99 && hit.is_interior;
            // Its nearest position lies within the patch, so that the voxel is in the patch's cylinder.
            if (is_over_patch) {
                ++reached;
                REQUIRE(patch[std::size_t(p)] == 7);
            }
            if (patch[std::size_t(p)] != 7) continue;
            REQUIRE(squared[std::size_t(p)] == Approx(hit.squared).margin(1e-4));
            REQUIRE((interior[std::size_t(p) >> 6] >> (p & 63) & 1) == hit.is_interior);
        }
    }
    CHECK(reached > 500);
}

TEST_CASE("A solid that reaches the domain's end is closed half a voxel beyond it") {
    const FloatGridPtr grid = extract_surface(*field(kDomain, [](const Vec3& x) { return x[0]; }));
    CHECK(grid->tree().getValue({0, 16, 16}) == Approx(-0.5 * kH));
    CHECK(grid->tree().getValue({-1, 16, 16}) == Approx(0.5 * kH));
    CHECK(extract_mesh(*grid).triangles.size() > 1000);
    CHECK(measure(extract_mesh(*grid)).volume == Approx(8.0 * 16 * 16).epsilon(0.01));
}

TEST_CASE("The surface of an inside tile has exact distances") {
    FloatGridPtr u = make_grid(kDomain, 1.0F, "u");
    u->tree().addTile(1, {8, 8, 8}, -1.0F, false);
    const FloatGridPtr grid = extract_surface(*u);
    CHECK(grid->tree().getValue({8, 11, 11}) == Approx(-0.5 * kH));
    CHECK(grid->tree().getValue({7, 11, 11}) == Approx(0.5 * kH));
    CHECK(grid->tree().getValue({5, 11, 11}) == Approx(2.5 * kH));
}

TEST_CASE("The surface is bitwise identical for 1, 2 and 8 threads") {
    const FloatGridPtr u = waves(kDomain, 9);
    RunContext run;
    run.threads = 1;
    const FloatGridPtr one = extract_surface(*u, run);
    for (const int threads : {2, 8}) {
        run.threads = threads;
        CHECK(identical(*one, *extract_surface(*u, run)));
    }
}

TEST_CASE("A field without a zero crossing, or with a negative background, is rejected") {
    CHECK_THROWS_AS(extract_surface(*field(kDomain, [](const Vec3&) { return 1.0; })), Error);
    CHECK_THROWS_AS(extract_surface(*make_grid(kDomain, 1.0F, "u")), Error);
    FloatGridPtr inside_out = make_grid(kDomain, -1.0F, "u");
    inside_out->tree().setValue({3, 3, 3}, 1.0F);
    CHECK_THROWS_AS(extract_surface(*inside_out), Error);
}

TEST_CASE("The fog volume is 1 deep inside, 0 outside, and linear across the inner half of the band") {
    const FloatGridPtr level_set =
        extract_surface(*field(kDomain, [](const Vec3& x) { return std::hypot(x[0], x[1], x[2]) - 5; }));
    const FloatGridPtr fog = to_fog_volume(*level_set);
    CHECK(fog->getGridClass() == openvdb::GRID_FOG_VOLUME);
    CHECK(fog->getName() == "density");
    for (auto at = box_of(kDomain).begin(); at; ++at) {
        const float d = level_set->tree().getValue(*at);
        REQUIRE(fog->tree().getValue(*at) == Approx(std::clamp(-d / kHalfWidth, 0.0, 1.0)).margin(1e-5));
    }
}

TEST_CASE("A label image has the label in voxels whose centre is inside, on an anisotropic lattice") {
    const Vec3 center{0.31, -0.27, 0.44};
    const auto off = [&](const Vec3& x) {
        return std::hypot(x[0] - center[0], x[1] - center[1], x[2] - center[2]) - 5;
    };
    const FloatGridPtr level_set = extract_surface(*field(kDomain, off));
    ImageGeometry geometry;
    geometry.size = {33, 29, 21};
    geometry.spacing = {0.47, 0.61, 0.83};
    geometry.origin = {-7.5, -8.5, -8.2};
    const std::vector<std::uint8_t> labels = rasterize(*level_set, geometry, 3);
    REQUIRE(labels.size() == std::size_t(33) * 29 * 21);
    std::size_t n = 0;
    for (int k = 0; k < 21; ++k)
        for (int j = 0; j < 29; ++j)
            for (int i = 0; i < 33; ++i, ++n) {
                const double d = off(geometry.index_to_world({double(i), double(j), double(k)}));
                if (std::abs(d) > 0.02) REQUIRE(labels[n] == (d < 0 ? 3 : 0));
            }
}

TEST_CASE("extract_surface: distances are correct if the surface passes through voxel centres up to rounding") {
    Domain domain;
    domain.max = {47, 47, 15};
    for (unsigned seed = 1; seed <= 8; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> power(-14, -4);
        const FloatGridPtr u = make_grid(domain, 3.0F, "u");
        for (auto at = box_of(domain).begin(); at; ++at) {
            const double off = std::pow(10, power(random)) * (random() % 2 == 0 ? 1 : -1);
            const int k = (*at).z();
            u->tree().setValue(*at, float(std::clamp(k == 8 ? off : k - 8.0, -3.0, 3.0)));
        }
        const FloatGridPtr surface = extract_surface(*u);
        double worst = 0;
        for (int i = 4; i <= 43; ++i)
            for (int j = 4; j <= 43; ++j)
                for (int k = 6; k <= 10; ++k)
                    worst = std::max(worst, std::abs(double(surface->tree().getValue({i, j, k})) - (k - 8)));
        INFO("draw " << seed);
        CHECK(worst < 3e-4);
    }
}
