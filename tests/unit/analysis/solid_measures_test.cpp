#include "covol/solid_measures.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "covol/error.h"

using namespace covol;

namespace {

/// A level set of an ellipsoid with the semi-axes `half`. Its values are f / |grad f| for f = |x / half| - 1, which is
/// the signed distance to first order near the surface.
FloatGridPtr ellipsoid(const openvdb::Vec3d& center, const openvdb::Vec3d& half, double voxel) {
    auto grid = std::make_shared<openvdb::FloatGrid>(float(3 * voxel));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    auto accessor = grid->getAccessor();
    const openvdb::Vec3d low = (center - half) / voxel, high = (center + half) / voxel;
    for (int i = int(low[0]) - 5; i < high[0] + 5; ++i)
        for (int j = int(low[1]) - 5; j < high[1] + 5; ++j)
            for (int k = int(low[2]) - 5; k < high[2] + 5; ++k) {
                const openvdb::Vec3d off = openvdb::Vec3d(i, j, k) * voxel - center, scaled = off / half;
                const double slope = (scaled / half).length(), length = scaled.length();
                const double d = length > 0 ? (length - 1) * length / slope : -3 * voxel;
                if (std::abs(d) < 3 * voxel)
                    accessor.setValueOn({i, j, k}, float(d));
                else if (d < 0)
                    accessor.setValueOff({i, j, k}, float(-3 * voxel));
            }
    return grid;
}

}  // namespace

TEST_CASE("Centroid and bounding box of an ellipsoid are accurate to 0.05 voxels") {
    openvdb::initialize();
    const openvdb::Vec3d center(1.23, -4.56, 7.89), half(2.1, 3.2, 4.3);
    const SolidMeasures found = measure_solid(*ellipsoid(center, half, 0.1));
    for (std::size_t a = 0; a < 3; ++a) {
        const auto axis = int(a);
        CHECK(found.centroid[a] == Approx(center[axis]).margin(0.001));
        // The outermost position of the surface lies between voxels. Therefore the measured box is too small, by about
        // half a squared voxel over a diameter.
        CHECK(found.box.max[a] - found.box.min[a] == Approx(2 * half[axis]).margin(0.005));
        CHECK((found.box.max[a] + found.box.min[a]) / 2 == Approx(center[axis]).margin(0.003));
    }
}

TEST_CASE("Interior tiles count, and solids far from the origin are measured accurately") {
    openvdb::initialize();
    const openvdb::Vec3d center(1e5, 2e5, -3e5);
    const auto ball = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(40, openvdb::Vec3f(0, 0, 0), 1);
    ball->setTransform(openvdb::math::Transform::createLinearTransform(1));
    ball->transform().postTranslate(center + openvdb::Vec3d(0.25, 0.5, 0.75));
    const SolidMeasures found = measure_solid(*ball);
    CHECK(found.centroid[0] == Approx(center[0] + 0.25).margin(1e-3));
    CHECK(found.centroid[1] == Approx(center[1] + 0.5).margin(1e-3));
    CHECK(found.centroid[2] == Approx(center[2] + 0.75).margin(1e-3));
    CHECK(found.box.max[0] - found.box.min[0] == Approx(80).margin(0.02));
}

TEST_CASE("The centroid is bit-identical on 1 and 8 threads, and an empty level set is rejected") {
    openvdb::initialize();
    const FloatGridPtr body = ellipsoid({1, 2, 3}, {2, 3, 4}, 0.2);
    RunContext one, eight;
    one.threads = 1;
    eight.threads = 8;
    CHECK(measure_solid(*body, one).centroid == measure_solid(*body, eight).centroid);
    CHECK_THROWS_AS(measure_solid(*std::make_shared<openvdb::FloatGrid>(1.0F)), Error);
}

TEST_CASE("The sphericity of a ball is 1, of a cube (pi / 6)^(1/3)") {
    CHECK(sphericity(4.0 / 3 * M_PI * 8, 4 * M_PI * 4) == Approx(1));
    CHECK(sphericity(1, 6) == Approx(std::cbrt(M_PI / 6)));
    CHECK(sphericity(1, 0) == 0);
}
