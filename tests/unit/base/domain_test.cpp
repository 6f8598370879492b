#include "covol/domain.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>

#include "covol/error.h"

using namespace covol;

TEST_CASE("a box of whole voxels is matched exactly") {
    const Domain d = make_domain({{-1.3, -1.3, -1.3}, {1.3, 1.3, 1.3}}, 0.01);
    CHECK(d.max == Index3{259, 259, 259});
    CHECK(d.origin[0] == Approx(-1.295));
    CHECK(d.world_box().max[2] == Approx(1.3));
}

TEST_CASE("any other box is covered and centred") {
    const Domain d = make_domain({{0, 0, 0}, {1.0, 2.05, 3.0}}, 0.5);
    CHECK(d.max == Index3{1, 4, 5});
    CHECK(d.world_box().min[1] == Approx(-0.225));
    CHECK(d.world_box().max[1] == Approx(2.275));
    CHECK(d.voxel_count() == 2 * 5 * 6);
}

TEST_CASE("a domain survives on a grid") {
    const Domain d = make_domain({{5, -2, 1}, {9, 3, 4}}, 0.25);
    const FloatGridPtr grid = make_grid(d, 1.0F, "u");
    CHECK(domain_of(*grid) == d);
    CHECK(grid->transform().indexToWorld(openvdb::Vec3d(2, 0, 0))[0] == Approx(d.index_to_world({2, 0, 0})[0]));
}

TEST_CASE("unusable boxes and transforms are refused") {
    CHECK_THROWS_AS(make_domain({{0, 0, 0}, {1, 1, 0}}, 0.1), Error);
    CHECK_THROWS_AS(make_domain({{0, 0, 0}, {1, 1, 1}}, 0.0), Error);
    CHECK_THROWS_AS(make_domain({{0, 0, 0}, {1e12, 1, 1}}, 1e-3), Error);
    auto grid = FloatGrid::create();
    grid->setTransform(openvdb::math::Transform::createLinearTransform(
        openvdb::math::Mat4d(1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)));
    CHECK_THROWS_AS(domain_of(*grid), Error);
}
