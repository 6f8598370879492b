// Tests of the starts that are made from a given surface (band.h).
#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>

#include "covol/error.h"
#include "covol/start.h"
#include "support/clouds.h"

using namespace covol;
using namespace covol::test;

namespace {

const Domain kDomain = make_domain({{-10, -10, -10}, {10, 10, 10}}, 0.5);
const Vec3 kCenter{0.7, -1.1, 0.3};
constexpr double kRadius = 5.0;

double sphere_distance(const Vec3& x) {
    return std::hypot(x[0] - kCenter[0], x[1] - kCenter[1], x[2] - kCenter[2]) - kRadius;
}

/// The maximum difference from the distance, clamped to three voxels. Checks that voxels are active exactly if their
/// value is below this clamp.
double worst_error(const FloatGrid& grid, const Domain& domain, const std::function<double(const Vec3&)>& distance) {
    const double clamp = 3 * domain.voxel_size;
    double worst = 0;
    for (int i = domain.min[0]; i <= domain.max[0]; ++i)
        for (int j = domain.min[1]; j <= domain.max[1]; ++j)
            for (int k = domain.min[2]; k <= domain.max[2]; ++k) {
                const float u = grid.tree().getValue({i, j, k});
                CHECK(grid.tree().isValueOn({i, j, k}) == (std::abs(u) < float(clamp)));
                worst = std::max(worst, std::abs(u - std::clamp(distance(world_of(domain, {i, j, k})), -clamp, clamp)));
            }
    return worst;
}

int active_outside(const FloatGrid& grid, const Domain& domain) {
    int n = 0;
    const openvdb::CoordBBox box({domain.min[0], domain.min[1], domain.min[2]},
                                 {domain.max[0], domain.max[1], domain.max[2]});
    for (auto value = grid.cbeginValueOn(); value; ++value) n += !box.isInside(value.getCoord());
    return n;
}

TriangleMesh tetrahedron(float size) {
    return {{{0, 0, 0}, {size, 0, 0}, {0, size, 0}, {0, 0, size}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

}  // namespace

TEST_CASE("The start from a sphere is its signed distance, clamped to the band") {
    const FloatGridPtr grid = start_from_sphere(kDomain, kCenter, kRadius);
    CHECK(worst_error(*grid, kDomain, sphere_distance) < 1e-5);
    CHECK(grid->getName() == "band");
    CHECK(grid->background() == 1.5F);
    CHECK(domain_of(*grid) == kDomain);
}

TEST_CASE("A sphere cut by the domain is filled up to the domain's end, but not beyond") {
    const Domain cut = make_domain({{-2, -2, -2}, {10, 3, 40}}, 0.25);
    const auto distance = [](const Vec3& x) { return std::hypot(x[0], x[1], x[2]) - 8; };
    const FloatGridPtr grid = start_from_sphere(cut, {0, 0, 0}, 8);
    CHECK(worst_error(*grid, cut, distance) < 1e-5);
    CHECK(active_outside(*grid, cut) == 0);
    double inside = 0;
    for (int i = cut.min[0]; i <= cut.max[0]; ++i)
        for (int j = cut.min[1]; j <= cut.max[1]; ++j)
            for (int k = cut.min[2]; k <= cut.max[2]; ++k) inside += distance(world_of(cut, {i, j, k})) < 0;
    CHECK(negative_volume(*grid) == Approx(inside * std::pow(0.25, 3)));
}

TEST_CASE("The start from a box is its signed distance, clamped to the band") {
    const WorldBox box{{-3.1, -4, -5}, {2, 6.2, 5}};
    const FloatGridPtr grid = start_from_box(kDomain, box);
    CHECK(value_at(*grid, {-0.25, 0.25, 0.25}) == -1.5F);
    CHECK(value_at(*grid, {2.25, 0.25, 0.25}) == Approx(0.25));
    CHECK(value_at(*grid, {1.25, 0.25, 0.25}) == Approx(-0.75));
    CHECK(value_at(*grid, {2.75, 6.75, 0.25}) == Approx(std::hypot(0.75, 0.55)).epsilon(1e-5));
    CHECK(negative_volume(*grid) == Approx(5.0 * 10.0 * 10.0).epsilon(0.03));
}

TEST_CASE("The start from a mesh is its signed distance") {
    const FloatGridPtr grid = start_from_mesh(kDomain, tetrahedron(8));
    CHECK(value_at(*grid, {2.25, 2.25, 0.25}) == Approx(-0.25).margin(1e-4));
    CHECK(value_at(*grid, {2.25, 2.25, -0.75}) == Approx(0.75).margin(1e-4));
    CHECK(value_at(*grid, {3.25, 3.25, 3.25}) == Approx((9.75 - 8) / std::sqrt(3.0)).margin(1e-3));
    CHECK(negative_volume(*grid) == Approx(8.0 * 8 * 8 / 6).epsilon(0.03));
    CHECK_THROWS_AS(start_from_mesh(kDomain, {}), Error);
}

TEST_CASE("The start from a coarser grid has its surface, within the error of linear interpolation") {
    Domain coarse = make_domain({{-11, -12, -13}, {11, 12, 13}}, 0.8);
    const FloatGridPtr grid = start_from_grid(kDomain, *start_from_sphere(coarse, kCenter, kRadius));
    CHECK(worst_error(*grid, kDomain, sphere_distance) < 0.12);  // the error of the coarse grid's linear interpolation
}

TEST_CASE("Redistancing keeps a plane exact although the field has a slope of 7") {
    const Vec3 normal{0.6, 0.64, 0.48};
    const auto distance = [&](const Vec3& x) { return normal[0] * x[0] + normal[1] * x[1] + normal[2] * x[2] - 0.7; };
    FloatGridPtr steep = make_grid(kDomain, 100.0F, "u");
    for (int i = kDomain.min[0]; i <= kDomain.max[0]; ++i)
        for (int j = kDomain.min[1]; j <= kDomain.max[1]; ++j)
            for (int k = kDomain.min[2]; k <= kDomain.max[2]; ++k)
                steep->tree().setValue({i, j, k}, float(7.0 * distance(world_of(kDomain, {i, j, k}))));
    const FloatGridPtr grid = start_from_grid(kDomain, *steep);
    double worst = 0;
    // Voxels near the domain's end are left out, because the plane ends there.
    for (int i = kDomain.min[0] + 6; i <= kDomain.max[0] - 6; ++i)
        for (int j = kDomain.min[1] + 6; j <= kDomain.max[1] - 6; ++j)
            for (int k = kDomain.min[2] + 6; k <= kDomain.max[2] - 6; ++k) {
                const double exact = std::clamp(distance(world_of(kDomain, {i, j, k})), -1.5, 1.5);
                worst = std::max(worst, std::abs(exact - grid->tree().getValue({i, j, k})));
            }
    CHECK(worst < 1e-4);
}

TEST_CASE("The start from a mask follows the mask") {
    ImageGeometry geometry;
    geometry.size = {40, 40, 10};
    geometry.spacing = {0.5, 0.5, 2.0};
    geometry.origin = {-9.75, -9.75, -9};
    std::vector<std::uint8_t> values(40 * 40 * 10);
    for (int k = 0; k < 10; ++k)
        for (int j = 0; j < 40; ++j)
            for (int i = 0; i < 40; ++i)
                values[(k * 40 + j) * 40 + i] =
                    sphere_distance(geometry.index_to_world({double(i), double(j), double(k)})) < 0 ? 45 : 0;
    const FloatGridPtr grid = start_from_mask(kDomain, Image::from_values(geometry, values.data()));
    CHECK(worst_error(*grid, kDomain, sphere_distance) < 1.3);  // the mask's slices are 2 apart
    CHECK(negative_volume(*grid) == Approx(4.0 / 3.0 * 3.14159265 * 125).epsilon(0.04));
    CHECK(value_at(*grid, kCenter) == -1.5F);

    SECTION("it ends at the image's end") {
        std::fill(values.begin(), values.end(), std::uint8_t(1));
        geometry.size = {20, 20, 5};
        const FloatGridPtr box = start_from_mask(kDomain, Image::from_values(geometry, values.data()));
        CHECK(negative_volume(*box) == Approx(10.0 * 10 * 10).epsilon(0.15));
        CHECK(value_at(*box, {3.25, -5.25, -5.25}) == 1.5F);
    }
}

TEST_CASE("A start without a surface in the domain is rejected") {
    CHECK_THROWS_AS(start_from_sphere(kDomain, {0, 0, 0}, 100), Error);
    CHECK_THROWS_AS(start_from_sphere(kDomain, {100, 0, 0}, 5), Error);
    CHECK_THROWS_AS(start_from_sphere(kDomain, {0, 0, 0}, -1), Error);
    CHECK_THROWS_AS(start_from_box(kDomain, {{0, 0, 0}, {1, 1, 0}}), Error);
    CHECK_THROWS_AS(start_from_grid(kDomain, *make_grid(kDomain, 1.0F, "u")), Error);
    ImageGeometry geometry;
    geometry.size = {4, 4, 4};
    const std::vector<std::uint8_t> empty(64, 0);
    CHECK_THROWS_AS(start_from_mask(kDomain, Image::from_values(geometry, empty.data())), Error);
}

TEST_CASE("The start from a grid is bitwise identical for 1 and 8 threads") {
    const FloatGridPtr source = start_from_sphere(kDomain, kCenter, kRadius);
    RunContext run;
    run.threads = 1;
    const FloatGridPtr one = start_from_grid(kDomain, *source, run);
    run.threads = 8;
    CHECK(identical(*one, *start_from_grid(kDomain, *source, run)));
}

TEST_CASE("A ball cut by faces of the domain has the correct sign everywhere, in each of eight octants") {
    // Large enough for tiles of both sizes below the root node.
    const Domain whole = make_domain({{-160, -160, -160}, {160, 160, 160}}, 1.0);
    const Vec3 center{3, -4, 5};
    const FloatGridPtr ball = start_from_sphere(make_domain({{-160, -160, -160}, {160, 160, 160}}, 2.0), center, 150);
    for (int octant = 0; octant < 8; ++octant) {
        Domain part = whole;
        for (int a = 0; a < 3; ++a) {
            const int middle = (whole.min[a] + whole.max[a]) / 2;
            (octant >> a & 1) ? part.min[a] = middle - 20 : part.max[a] = middle + 20;
        }
        const FloatGridPtr u = start_from_grid(part, *ball);
        int wrong = 0, inside = 0;
        for (int i = part.min[0]; i <= part.max[0]; i += 5)
            for (int j = part.min[1]; j <= part.max[1]; j += 5)
                for (int k = part.min[2]; k <= part.max[2]; k += 5) {
                    const Vec3 x = part.index_to_world({double(i), double(j), double(k)});
                    const double d = std::hypot(x[0] - center[0], x[1] - center[1], x[2] - center[2]) - 150;
                    if (std::abs(d) < 2) continue;
                    inside += d < 0;
                    wrong += (u->tree().getValue({i, j, k}) < 0) != (d < 0);
                }
        CHECK(inside > 10000);
        CHECK(wrong == 0);
    }
}
