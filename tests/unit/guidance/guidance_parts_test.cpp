// Parts of the image guidance: distances in a wide band, and pieces that a displacement separates.
#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "base/heuristics.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "guidance/patches.h"
#include "guidance/wide_distance.h"
#include "support/clouds.h"
#include "support/shapes.h"
#include "surface/pieces.h"

using namespace covol;
using covol::test::length;

namespace {

constexpr double kRadius = 16, kWidth = 12;

Domain cube(int half, double h) {
    Domain domain;
    domain.voxel_size = h;
    domain.min = {-half, -half, -half};
    domain.max = {half, half, half};
    return domain;
}

}  // namespace

TEST_CASE("WideDistance: distances to a sphere in a wide band, and the sphere moved by an offset", "[guidance]") {
    const double h = 0.5;
    const Domain domain = cube(32, h);
    const FloatGridPtr start = start_from_sphere(domain, {0, 0, 0}, kRadius * h);
    const TriangleMesh mesh = extract_mesh(*start);
    std::vector<Vec3> vertices;
    for (const auto& v : mesh.vertices) vertices.push_back({v[0], v[1], v[2]});
    const guidance::WideDistance wide(*start, vertices, domain, kWidth, {});
    double maximum = 0;
    std::int64_t count = 0;
    for (auto value = wide.grid()->cbeginValueOn(); value; ++value) {
        const openvdb::Vec3d x = wide.grid()->indexToWorld(value.getCoord());
        maximum = std::max(maximum, std::abs(double(*value) - (x.length() - kRadius * h)) / h);
        ++count;
    }
    // Distances above 2.5 voxels are measured to the vertices of the surface. Every position on it is within sqrt(3) /
    // 2 voxels of a vertex, which limits the error.
    CHECK(maximum < std::hypot(2.5, 0.5 * std::sqrt(3.0)) - 2.5 + 0.03);
    // The band contains all voxels within its width, on both sides of the surface.
    const double shell = 4.0 / 3 * M_PI * (std::pow(kRadius + kWidth, 3) - std::pow(kRadius - kWidth, 3));
    CHECK(double(count) == Approx(shell).epsilon(0.02));
    const auto accessor = wide.grid()->getConstAccessor();
    CHECK(accessor.getValue(openvdb::Coord(0, 0, 0)) == Approx(-kWidth * h));
    CHECK(accessor.getValue(openvdb::Coord(32, 32, 32)) == Approx(kWidth * h));

    for (const double out : {-6.0, 4.0}) {
        const FloatGridPtr moved = wide.less(std::vector<double>(mesh.vertices.size(), out * h));
        CHECK(test::negative_volume(*moved) == Approx(4.0 / 3 * M_PI * std::pow((kRadius + out) * h, 3)).epsilon(0.02));
    }
}

TEST_CASE("drop_unmarked_pieces: small pieces and cavities are removed unless a mark is near", "[guidance]") {
    const Domain domain = cube(32, 1);
    const Vec3 speck{26, 0, 0}, bubble{0, -8, 0};
    const auto made = [&] {
        FloatGridPtr u = make_grid(domain, 40, "u");
        auto accessor = u->getAccessor();
        for (auto at = openvdb::CoordBBox(openvdb::Coord(-32), openvdb::Coord(32)).begin(); at; ++at) {
            const Vec3 x{double((*at)[0]), double((*at)[1]), double((*at)[2])};
            const double ball = length(x) - kRadius,
                         small = length({x[0] - speck[0], x[1] - speck[1], x[2] - speck[2]}) - 1.5,
                         hole = length({x[0] - bubble[0], x[1] - bubble[1], x[2] - bubble[2]}) - 1.5;
            accessor.setValue(*at, float(std::max(std::min(ball, small), -hole)));
        }
        return u;
    };
    const auto sides = [&](const FloatGrid& u) {
        const auto accessor = u.getConstAccessor();
        return std::pair(accessor.getValue(openvdb::Coord(26, 0, 0)) < 0,
                         accessor.getValue(openvdb::Coord(0, -8, 0)) >= 0);
    };
    const FloatGridPtr none = made();
    REQUIRE(sides(*none) == std::pair(true, true));
    detail::drop_unmarked_pieces(*none, {{0, 0, kRadius}});
    CHECK(sides(*none) == std::pair(false, false));
    CHECK(test::negative_volume(*none) == Approx(4.0 / 3 * M_PI * std::pow(kRadius, 3)).epsilon(0.02));
    const FloatGridPtr marked = made();
    detail::drop_unmarked_pieces(*marked, {{27.5, 0, 0}});
    CHECK(sides(*marked) == std::pair(true, false));
}

TEST_CASE("drop_unmarked_pieces: pieces of a random field are those of a plain search through faces", "[guidance]") {
    using openvdb::Coord;
    const std::uint64_t seed = GENERATE(1U, 2U, 3U);
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<float> uniform(-1, 1);
    const Domain domain = cube(13, 1);
    const openvdb::CoordBBox box(Coord(-13), Coord(13));
    const FloatGridPtr u = make_grid(domain, 40, "u");
    std::map<Coord, float> expected;  // active voxels
    const float bias = seed == 2 ? 0.45F : 0.5F;
    for (auto at = box.begin(); at; ++at) {
        const float value = uniform(random) + ((*at)[0] < 0 ? bias : -bias);
        if (uniform(random) > -0.95F) {
            u->tree().setValueOn(*at, value);
            expected[*at] = value;
        } else {
            u->tree().setValueOff(*at, value);
        }
    }
    const std::vector<Vec3> marks{{-9, -8, 3}, {10, 2, -6}};

    std::size_t gone = 0;
    for (const bool inside : {true, false}) {
        std::vector<std::vector<Coord>> pieces;
        std::map<Coord, bool> seen;
        for (const auto& [start, value] : expected) {
            if ((value < 0) != inside || seen[start]) continue;
            std::vector<Coord> piece{start};
            seen[start] = true;
            for (std::size_t n = 0; n < piece.size(); ++n)
                for (int face = 0; face < 6; ++face) {
                    Coord next = piece[n];
                    next[face / 2] += face % 2 ? 1 : -1;
                    const auto there = expected.find(next);
                    if (there == expected.end() || (there->second < 0) != inside || seen[next]) continue;
                    seen[next] = true;
                    piece.push_back(next);
                }
            pieces.push_back(piece);
        }
        std::sort(pieces.begin(), pieces.end(), [](auto& x, auto& y) { return x.size() > y.size(); });
        for (std::size_t n = 1; n < pieces.size(); ++n) {
            openvdb::CoordBBox around;
            for (const Coord& c : pieces[n]) around.expand(c);
            around.expand(int(kHalfWidthVoxels));
            const bool marked = std::any_of(marks.begin(), marks.end(), [&](const Vec3& m) {
                return around.isInside(Coord::round(openvdb::Vec3d(m[0], m[1], m[2])));
            });
            if (marked || double(pieces[n].size()) > kCommon.negligible * double(pieces[0].size())) continue;
            ++gone;
            for (const Coord& c : pieces[n]) expected[c] = inside ? 0.5F : -0.5F;
        }
    }
    CHECK(gone > 100);
    detail::drop_unmarked_pieces(*u, marks);
    CHECK(u->activeVoxelCount() == expected.size());
    for (const auto& [at, value] : expected)
        if (u->tree().getValue(at) != value) FAIL_CHECK(at << ": " << u->tree().getValue(at) << ", expected " << value);
}

TEST_CASE("Patches partition a surface's vertices and area, and have the right borders and neighbours", "[guidance]") {
    const double h = 0.5, radius = 8;
    const TriangleMesh mesh = extract_mesh(*start_from_sphere(cube(24, h), {0, 0, 0}, radius));
    guidance::SurfaceVertices vertices = guidance::vertices_of(mesh, 1.5);
    ImageGeometry geometry;
    geometry.size = {40, 40, 40};
    geometry.spacing = {0.5, 0.5, 0.5};
    geometry.origin = {-10, -10, -10};
    guidance::Patches patches = guidance::cut_patches(vertices, geometry, 2.0);
    guidance::find_borders(std::move(vertices), patches);

    std::vector<int> met(mesh.vertices.size(), 0);
    double area = 0;
    for (std::size_t i = 0; i < patches.size(); ++i) {
        for (std::uint32_t n = patches.first[i]; n < patches.first[i + 1]; ++n) {
            const std::uint32_t v = patches.members[n];
            ++met[v];
            CHECK(patches.patch[v] == i);
            // The members of a patch lie in one cell with an edge of four voxels (2.0), so they are at most its
            // diagonal apart.
            CHECK(length({patches.places[v][0] - patches.centers[i][0], patches.places[v][1] - patches.centers[i][1],
                          patches.places[v][2] - patches.centers[i][2]}) < 2.0 * std::sqrt(3.0));
        }
        area += patches.area[i];
        // The surface is a sphere around the origin, so a patch's direction, its mean normal, is close to that of its
        // centre.
        const Vec3& c = patches.centers[i];
        const double along =
            (c[0] * patches.directions[i][0] + c[1] * patches.directions[i][1] + c[2] * patches.directions[i][2]) /
            length(c);
        CHECK(along > 0.99);
    }
    CHECK(std::all_of(met.begin(), met.end(), [](int n) { return n == 1; }));
    CHECK(area == Approx(measure(mesh).area));
    CHECK(patches.size() > 100);

    std::map<std::pair<std::uint32_t, std::uint32_t>, double> lengths;
    for (const auto& t : mesh.triangles)
        for (int c = 0; c < 3; ++c) {
            const std::uint32_t v = t[c], w = t[(c + 1) % 3], a = patches.patch[v], b = patches.patch[w];
            if (a == b) continue;
            const Vec3 x = mesh.place(v), y = mesh.place(w);
            lengths[std::minmax(a, b)] += 0.5 * length({x[0] - y[0], x[1] - y[1], x[2] - y[2]}) / std::sqrt(3.0);
        }
    REQUIRE(patches.borders.size() == lengths.size());
    for (const auto& border : patches.borders) {
        CHECK(border.length == Approx(lengths.at({border.a, border.b})).epsilon(1e-5));
        for (const auto& [one, other] : {std::pair(border.a, border.b), std::pair(border.b, border.a)})
            CHECK(std::count(patches.neighbours[one].begin(), patches.neighbours[one].end(), other) == 1);
    }
}
