#include "covol/compare.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "covol/domain.h"
#include "covol/error.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "support/shapes.h"

using namespace covol;

namespace {

constexpr double kPi = 3.14159265358979323846;

double distance(const Vec3& a, const Vec3& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

FloatGridPtr sphere_grid(const Vec3& centre, double radius, double h) {
    Domain domain;
    domain.voxel_size = h;
    domain.origin = {0.3 * h, -0.2 * h, 0.1 * h};
    FloatGridPtr grid = make_grid(domain, float(3 * h), "surface");
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    auto accessor = grid->getAccessor();
    const int n = int(std::ceil((radius + 3 * h) / h)) + 1;
    const Vec3 middle = domain.world_to_index(centre);
    for (int i = -n; i <= n; ++i)
        for (int j = -n; j <= n; ++j)
            for (int k = -n; k <= n; ++k) {
                const openvdb::Coord at(int(middle[0]) + i, int(middle[1]) + j, int(middle[2]) + k);
                const double d =
                    distance(domain.index_to_world({double(at.x()), double(at.y()), double(at.z())}), centre) - radius;
                if (d < 3 * h) accessor.setValue(at, float(std::max(d, -3 * h)));
            }
    return grid;
}

Solid level_set(const Vec3& centre, double radius, double h) {
    Solid solid;
    solid.level_set = sphere_grid(centre, radius, h);
    return solid;
}

Solid mesh_of(const Solid& other) {
    Solid solid;
    solid.mesh = extract_mesh(*other.level_set);
    return solid;
}

Solid mask_of(const ImageGeometry& geometry, const std::function<int(const Vec3&)>& label) {
    std::vector<std::uint8_t> values;
    for (int k = 0; k < geometry.size[2]; ++k)
        for (int j = 0; j < geometry.size[1]; ++j)
            for (int i = 0; i < geometry.size[0]; ++i)
                values.push_back(std::uint8_t(label(geometry.index_to_world({double(i), double(j), double(k)}))));
    Solid solid;
    solid.mask = Image::from_values(geometry, values.data());
    return solid;
}

/// An image geometry whose axes are rotated (30 degrees around z, 40 degrees around x) and whose spacing differs along
/// each axis.
ImageGeometry rotated_geometry() {
    const double c = std::cos(kPi / 6), s = std::sin(kPi / 6), d = std::cos(kPi / 4.5), t = std::sin(kPi / 4.5);
    ImageGeometry geometry;
    geometry.direction = {{{c, -s * d, s * t}, {s, c * d, -c * t}, {0, t, d}}};
    geometry.spacing = {0.05, 0.08, 0.13};
    geometry.size = {60, 40, 26};
    geometry.origin = {10, 20, 30};
    return geometry;
}

Vec3 middle_of(const ImageGeometry& g) {
    return g.index_to_world({0.5 * (g.size[0] - 1), 0.5 * (g.size[1] - 1), 0.5 * (g.size[2] - 1)});
}

}  // namespace

TEST_CASE("Shifted spheres have the analytic overlap and distances, as level sets and as meshes") {
    const double r = 1.0, shift = 0.4, h = 0.05;
    const Solid a = level_set({0, 0, 0}, r, h), b = level_set({shift, 0, 0}, r, h);
    const double whole = 4.0 / 3 * kPi * r * r * r;
    const double common = kPi * (4 * r + shift) * std::pow(2 * r - shift, 2) / 12;
    // A point of one unit sphere at angle t from the line through the centres is |sqrt(1 + s^2 - 2 s cos t) - 1| from
    // the other sphere, whose centre is shifted by s. Its mean over all points is the mean over cos t in [-1, 1].
    double mean = 0;
    for (int i = 0; i < 1000; ++i)
        mean += std::abs(std::sqrt(r * r + shift * shift - 2 * shift * r * (-1 + (i + 0.5) / 500)) - r) / 1000;
    const Solid mesh_a = mesh_of(a), mesh_b = mesh_of(b);
    for (const auto& [first, second] : {std::pair{&a, &b}, {&mesh_a, &b}, {&a, &mesh_b}, {&mesh_a, &mesh_b}}) {
        const CompareReport report = compare(*first, *second);
        CHECK(report.dice == Approx(common / whole).margin(0.003));
        CHECK(report.jaccard == Approx(common / (2 * whole - common)).margin(0.003));
        CHECK(report.volume_a == Approx(whole).epsilon(0.005));
        CHECK(report.volume_b == Approx(whole).epsilon(0.005));
        CHECK(report.hausdorff == Approx(shift).margin(0.02 * h));
        CHECK(report.assd == Approx(mean).margin(0.03 * h));
    }
}

TEST_CASE("Concentric spheres: every distance is the difference of the radii") {
    const CompareReport report = compare(level_set({1, 2, 3}, 1.0, 0.05), level_set({1, 2, 3}, 0.8, 0.04));
    CHECK(report.dice == Approx(2 * 0.512 / 1.512).margin(0.003));
    for (const double d : {report.hausdorff, report.hd95, report.assd}) CHECK(d == Approx(0.2).margin(0.002));
}

TEST_CASE("compare: a solid has a Dice coefficient of 1 with itself and above 0.999 with its own mesh") {
    const Solid a = level_set({0.5, 0.5, 0.5}, 1.0, 0.1);
    const Solid mesh = mesh_of(a);
    CHECK(compare(a, a).dice == 1.0);
    CHECK(compare(a, a).hausdorff < 1e-6);
    CHECK(compare(mesh, mesh).dice == 1.0);
    // The value of the level set is interpolated trilinearly and the mesh is piecewise linear. Hence they disagree only
    // at voxel centres that are close to the surface.
    CHECK(compare(a, mesh).dice > 0.999);
}

TEST_CASE("A rotated anisotropic mask agrees with the mesh and the level set of the same sphere") {
    const ImageGeometry geometry = rotated_geometry();
    const Vec3 centre = middle_of(geometry);
    const double r = 1.2;
    const Solid mask = mask_of(geometry, [&](const Vec3& p) { return distance(p, centre) < r; });
    const Solid smooth = level_set(centre, r, 0.05);
    const double whole = 4.0 / 3 * kPi * r * r * r;
    const Solid smooth_mesh = mesh_of(smooth);
    for (const Solid* other : {&smooth, &smooth_mesh}) {
        const CompareReport report = compare(mask, *other);
        CHECK(report.dice > 0.998);
        CHECK(report.volume_a == Approx(whole).epsilon(0.01));
        // Both surfaces lie between neighbouring voxel centres of the mask, which are at most 0.13 apart.
        CHECK(report.hausdorff <= 0.13);
        CHECK(report.assd < 0.03);
    }
    const CompareReport swapped = compare(smooth, mask);
    CHECK(swapped.dice == compare(mask, smooth).dice);
    CHECK(swapped.hausdorff == Approx(compare(mask, smooth).hausdorff));
}

TEST_CASE("compare: a mask on a mirrored lattice agrees with the mesh of the same sphere") {
    ImageGeometry geometry = rotated_geometry();
    for (auto& row : geometry.direction) row[2] = -row[2];
    const Vec3 centre = middle_of(geometry);
    const Solid mask = mask_of(geometry, [&](const Vec3& p) { return distance(p, centre) < 1.0; });
    Solid ball = mesh_of(level_set(centre, 1.0, 0.05));
    CHECK(compare(mask, ball).dice > 0.998);
    CHECK(compare(mask, mask).dice == 1.0);
}

TEST_CASE("compare: parts of a solid outside of the other mask's image count") {
    ImageGeometry geometry;
    geometry.size = {20, 20, 20};
    geometry.spacing = {0.1, 0.1, 0.1};
    geometry.origin = {0.05, 0.05, 0.05};
    // The mask fills its image, the box [0,2]^3. The image of the other mask is three times as long along x.
    const Solid full = mask_of(geometry, [](const Vec3&) { return 7; });
    geometry.size[0] = 60;
    const Solid longer = mask_of(geometry, [](const Vec3&) { return 1; });
    const CompareReport report = compare(full, longer);
    CHECK(report.dice == Approx(0.5));
    CHECK(report.jaccard == Approx(1.0 / 3));
    CHECK(report.volume_a == Approx(8));
    CHECK(report.volume_b == Approx(24));
    CHECK(report.hausdorff == Approx(4).margin(0.1));
}

TEST_CASE("compare: the given label of a mask is used, by default all labels, and an absent one is rejected") {
    ImageGeometry geometry;
    geometry.size = {16, 8, 8};
    Solid halves = mask_of(geometry, [](const Vec3& p) { return p[0] < 8 ? 1 : 2; });
    const Solid all = halves;
    halves.label = 2;
    CHECK(compare(halves, all).volume_a == Approx(512));
    CHECK(compare(halves, all).dice == Approx(2.0 / 3));
    halves.label = 3;
    CHECK_THROWS_AS(compare(halves, all), Error);
}

TEST_CASE("compare: voxel rows through edges and corners of a mesh are counted once, open meshes are rejected") {
    // A cube whose faces, edges and corners lie on rows of voxel centres.
    ImageGeometry geometry;
    geometry.size = {8, 8, 8};
    const Solid voxels = mask_of(geometry, [](const Vec3& p) {
        for (const double c : p)
            if (c < 2 || c > 5) return 0;
        return 1;
    });
    Solid cube;
    cube.mesh.emplace();
    for (int c = 0; c < 8; ++c)
        cube.mesh->vertices.push_back({c & 4 ? 6.0F : 2.0F, c & 2 ? 6.0F : 2.0F, c & 1 ? 6.0F : 2.0F});
    cube.mesh->triangles = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                            {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
    const CompareReport report = compare(voxels, cube);
    // The mesh's cube from 2 to 6 contains the voxel centres at 2, 3, 4 and 5 along each axis, as the mask does: a row
    // of centres in a lower face of the cube counts as inside, one in an upper face as outside.
    CHECK(report.dice == 1.0);
    CHECK(report.volume_b == Approx(64));
    cube.mesh->triangles.erase(cube.mesh->triangles.begin());
    CHECK_THROWS_WITH(compare(voxels, cube), Catch::Contains("not closed"));
}

TEST_CASE("measure_fit to a mesh: exact distances, mean, 95th percentile and maximum") {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    const FitStatistics one = measure_fit({{0.2, 0.2, 3}}, mesh);
    CHECK(one.mean == Approx(3));
    CHECK(measure_fit({{-3, -4, 0}}, mesh).max == Approx(5));
    CHECK(measure_fit({{1, 1, 0}}, mesh).max == Approx(std::sqrt(0.5)));
    std::vector<Vec3> points;
    for (int i = 1; i <= 100; ++i) points.push_back({0.2, 0.2, double(i)});
    const FitStatistics fit = measure_fit(points, mesh);
    CHECK(fit.mean == Approx(50.5));
    CHECK(fit.p95 == Approx(95));
    CHECK(fit.max == Approx(100));
    CHECK_THROWS_AS(measure_fit({}, mesh), Error);
    CHECK_THROWS_AS(measure_fit(points, TriangleMesh{}), Error);
}

TEST_CASE("measure_fit to a level set: distances within and beyond the narrow band are accurate to 0.12 voxels") {
    const Domain domain = make_domain({{-40, -40, -40}, {40, 40, 40}}, 1.0);
    const FloatGridPtr ball = extract_surface(*start_from_sphere(domain, {0.3, 0.2, 0.1}, 25));
    for (const double r : {25.2, 26.5, 27.5, 28.5, 33.0, 21.5, 5.0}) {
        std::vector<Vec3> points = test::sphere_points(500, r);
        for (Vec3& p : points) p = {p[0] + 0.3, p[1] + 0.2, p[2] + 0.1};
        const FitStatistics fit = measure_fit(points, *ball);
        INFO(r);
        CHECK(fit.max < std::abs(r - 25) + 0.12);
        CHECK(fit.max > std::abs(r - 25) - 0.01);
        CHECK(fit.mean == Approx(std::abs(r - 25)).margin(0.06));
    }
    CHECK_THROWS_AS(measure_fit({}, *ball), Error);
}

TEST_CASE("compare: the report does not depend on the number of threads") {
    const Solid a = level_set({0, 0, 0}, 1.0, 0.1), b = mesh_of(level_set({0.1, 0, 0.2}, 0.9, 0.1));
    RunContext run;
    run.threads = 1;
    const CompareReport one = compare(a, b, run);
    run.threads = 2;
    const CompareReport two = compare(a, b, run);
    CHECK(one.dice == two.dice);
    CHECK(one.assd == two.assd);
    CHECK(one.hd95 == two.hd95);
}
