// Compares a level set on another lattice with OpenVDB's own interpolation.
#include "start/other_lattice.h"

#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <catch2/catch.hpp>

using namespace covol;
using openvdb::Coord;

namespace {

FloatGridPtr sphere_on(const openvdb::math::Transform::Ptr& transform) {
    FloatGridPtr grid = openvdb::tools::createLevelSetSphere<FloatGrid>(12, openvdb::Vec3f(1, 2, 3), 1, 4);
    grid->setTransform(transform);
    return grid;
}

}  // namespace

TEST_CASE("Resampling to another lattice is trilinear for any scale and rotation") {
    const Domain domain = make_domain({{-14, -14, -14}, {14, 14, 14}}, 1.0);
    const openvdb::math::Transform::Ptr turned = openvdb::math::Transform::createLinearTransform(0.9);
    turned->postRotate(0.4, openvdb::math::X_AXIS);
    turned->postRotate(0.3, openvdb::math::Z_AXIS);
    for (const auto& transform :
         {openvdb::math::Transform::createLinearTransform(0.5), openvdb::math::Transform::createLinearTransform(2.0),
          turned, openvdb::math::Transform::createLinearTransform(0.05)}) {
        const FloatGridPtr grid = sphere_on(transform);
        const detail::ToSource to_source(domain, grid->transform());
        CHECK_FALSE(to_source.shift());
        const detail::Sampler sample = detail::sampler_of(*grid, to_source);
        const Coord lo(-4, 0, 3), hi(3, 7, 11);
        std::vector<float> values(8 * 8 * 9);
        sample(lo, hi, values.data());
        const auto accessor = grid->getConstAccessor();
        std::size_t n = 0;
        for (int i = lo.x(); i <= hi.x(); ++i)
            for (int j = lo.y(); j <= hi.y(); ++j)
                for (int k = lo.z(); k <= hi.z(); ++k, ++n)
                    REQUIRE(values[n] ==
                            Approx(openvdb::tools::BoxSampler::sample(accessor, to_source(i, j, k))).margin(1e-4));
    }
}

TEST_CASE("Resampling to a lattice shifted by whole voxels copies the values") {
    const Domain domain = make_domain({{-14, -14, -14}, {14, 14, 14}}, 1.0);
    const openvdb::math::Transform::Ptr shifted = openvdb::math::Transform::createLinearTransform(1.0);
    shifted->postTranslate(openvdb::Vec3d(domain.origin[0] + 3, domain.origin[1] - 2, domain.origin[2]));
    const FloatGridPtr grid = sphere_on(shifted);
    const detail::ToSource to_source(domain, grid->transform());
    REQUIRE(to_source.shift() == Coord(-3, 2, 0));
    std::vector<float> values(512);
    detail::sampler_of(*grid, to_source)(Coord(0, 0, 0), Coord(7, 7, 7), values.data());
    const auto accessor = grid->getConstAccessor();
    for (int n = 0; n < 512; ++n)
        REQUIRE(values[std::size_t(n)] == accessor.getValue(Coord((n >> 6) - 3, (n >> 3 & 7) + 2, n & 7)));
}

TEST_CASE("may_cross: blocks of one sign have no crossing, and large blocks are not examined") {
    const FloatGridPtr grid = sphere_on(openvdb::math::Transform::createLinearTransform(1.0));
    CHECK_FALSE(detail::may_cross(*grid, {Coord(-2, -2, -2), Coord(4, 4, 4)}));
    CHECK_FALSE(detail::may_cross(*grid, {Coord(20, 20, 20), Coord(26, 26, 26)}));
    CHECK(detail::may_cross(*grid, {Coord(10, 0, 0), Coord(16, 6, 6)}));
    CHECK(detail::may_cross(*grid, {Coord(-2, -2, -2), Coord(9, 9, 9)}));  // too large to be examined
}
