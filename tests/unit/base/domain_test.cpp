#include "covol/domain.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <limits>

#include "covol/error.h"

using namespace covol;

TEST_CASE("make_domain: a box of whole voxels is matched exactly") {
    const Domain d = make_domain({{-1.3, -1.3, -1.3}, {1.3, 1.3, 1.3}}, 0.01);
    CHECK(d.max == Index3{259, 259, 259});
    CHECK(d.origin[0] == Approx(-1.295));
    CHECK(d.world_box().max[2] == Approx(1.3));
}

TEST_CASE("make_domain: any other box is covered by a domain with the same centre") {
    const Domain d = make_domain({{0, 0, 0}, {1.0, 2.05, 3.0}}, 0.5);
    CHECK(d.max == Index3{1, 4, 5});
    CHECK(d.world_box().min[1] == Approx(-0.225));
    CHECK(d.world_box().max[1] == Approx(2.275));
    CHECK(d.voxel_count() == 2 * 5 * 6);
}

TEST_CASE("domain_of: a domain is recovered from the grid that was made for it") {
    const Domain d = make_domain({{5, -2, 1}, {9, 3, 4}}, 0.25);
    const FloatGridPtr grid = make_grid(d, 1.0F, "u");
    CHECK(domain_of(*grid) == d);
    CHECK(grid->transform().indexToWorld(openvdb::Vec3d(2, 0, 0))[0] == Approx(d.index_to_world({2, 0, 0})[0]));
}

TEST_CASE("Empty boxes, unsuitable voxel sizes and anisotropic transforms are rejected") {
    CHECK_THROWS_AS(make_domain({{0, 0, 0}, {1, 1, 0}}, 0.1), Error);
    CHECK_THROWS_AS(make_domain({{0, 0, 0}, {1, 1, 1}}, 0.0), Error);
    CHECK_THROWS_AS(make_domain({{0, 0, 0}, {1e-11, 1e-11, 1e-11}}, 1e-12),
                    Error);  // OpenVDB does not support voxels this small
    CHECK_NOTHROW(set_domain(*FloatGrid::create(), make_domain({{0, 0, 0}, {1e-3, 1e-3, 1e-3}}, 1.5e-5)));
    CHECK_THROWS_AS(make_domain({{0, 0, 0}, {1e12, 1, 1}}, 1e-3), Error);
    auto grid = FloatGrid::create();
    grid->setTransform(openvdb::math::Transform::createLinearTransform(
        openvdb::math::Mat4d(1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)));
    CHECK_THROWS_AS(domain_of(*grid), Error);
}

TEST_CASE("covering: a part of a domain lies on its lattice, and empty or distant boxes are rejected") {
    const Domain whole = make_domain({{0, 0, 0}, {10, 10.3, 11}}, 0.5);
    CHECK(covering(whole, whole.world_box()) == whole);
    CHECK(covering(whole, {{0, 0, 0}, {10, 10.3, 11}}) == whole);
    const Domain part = covering(whole, {{2.1, 3, 4}, {6, 5.2, 4.2}});
    CHECK(part.origin == whole.origin);
    CHECK(part.min == Index3{4, 6, 8});
    CHECK(part.max == Index3{11, 10, 8});
    for (int a = 0; a < 3; ++a) {
        CHECK(part.world_box().min[a] <= Vec3{2.1, 3, 4}[a]);
        CHECK(part.world_box().max[a] >= Vec3{6, 5.2, 4.2}[a]);
    }
    CHECK_THROWS_AS(covering(whole, {{0, 0, 0}, {1, 0, 1}}), Error);
    CHECK_THROWS_AS(covering(whole, {{1e7, 0, 0}, {1e7 + 1, 1, 1}}), Error);
}

TEST_CASE("choose_domain: the lattice does not depend on the requested part") {
    const WorldBox image{{0, 0, 0}, {10, 10.3, 11}}, part{{2, 3, 4}, {5, 6, 7}}, other{{1.7, 8, 0}, {9, 9.1, 3}};
    CHECK(choose_domain(image, 0.5, image, {}) == make_domain(image, 0.5));
    CHECK(choose_domain(part, 0.5, image, {}).origin == make_domain(image, 0.5).origin);
    CHECK(choose_domain(part, 0.5, {}, {}).origin == Vec3{0, 0, 0});
    CHECK(choose_domain(part, 0.5, {}, {}).min == Index3{4, 6, 8});
    CHECK(choose_domain(other, 0.5, image, Vec3{1, 2, 3}).origin == Vec3{1, 2, 3});
    // At 4e6 world units, indices counted from the world's origin (4e8 voxels) would overflow the keys of leaves. The
    // lattice then has another origin, which is the same for neighbouring domains.
    const WorldBox far{{4e6, 5e6, 0}, {4e6 + 10, 5e6 + 10, 10}}, beside{{4e6 + 9, 5e6, 0}, {4e6 + 20, 5e6 + 9, 10}};
    const Domain a = choose_domain(far, 0.01, {}, {}), b = choose_domain(beside, 0.01, {}, {});
    CHECK(a.origin == b.origin);
    CHECK(a.max[0] > b.min[0]);
    CHECK(a.world_box().min[0] <= 4e6);
}

TEST_CASE("domain_of: grids with indices or transforms out of range are rejected") {
    const Domain good = make_domain({{0, 0, 0}, {4, 4, 4}}, 1.0);
    const auto with = [&](openvdb::Vec3i min, openvdb::Vec3i max) {
        FloatGridPtr grid = make_grid(good, 1.0F, "u");
        grid->insertMeta("covol_domain_min", openvdb::Vec3IMetadata(min));
        grid->insertMeta("covol_domain_max", openvdb::Vec3IMetadata(max));
        return grid;
    };
    CHECK_NOTHROW(domain_of(*with({0, 0, 0}, {7, 7, 7})));
    constexpr int kInt = std::numeric_limits<int>::max();
    CHECK_THROWS_AS(domain_of(*with({0, 0, 0}, {kInt, 7, 7})), Error);
    CHECK_THROWS_AS(domain_of(*with({-kInt - 1, 0, 0}, {7, 7, 7})), Error);
    CHECK_THROWS_AS(domain_of(*with({0, 9, 0}, {7, 7, 7})), Error);
    auto far = FloatGrid::create();
    far->tree().setValueOn(openvdb::Coord(kInt - 3, 0, 0), 1.0F);
    CHECK_THROWS_AS(domain_of(*far), Error);
    auto thin = FloatGrid::create();
    thin->setTransform(openvdb::math::Transform::createLinearTransform(1e300));
    thin->transform().postTranslate(openvdb::Vec3d(std::numeric_limits<double>::infinity(), 0, 0));
    CHECK_THROWS_AS(domain_of(*thin), Error);
}
