#include "covol/intensity.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

using namespace covol;

namespace {

constexpr int kSide = 40;

/// An image of kSide^3 voxels with the values 100000 + i. The large offset makes rounding errors of the standard
/// deviation visible.
Image ramp(double spacing) {
    ImageGeometry geometry;
    geometry.size = {kSide, kSide, kSide};
    geometry.spacing = {spacing, spacing, spacing};
    std::vector<float> values;
    for (int k = 0; k < kSide; ++k)
        for (int j = 0; j < kSide; ++j)
            for (int i = 0; i < kSide; ++i) values.push_back(100000.0F + float(i));
    return Image::from_values(geometry, values.data());
}

FloatGridPtr sphere(double radius, const openvdb::Vec3f& center, double voxel) {
    return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(float(radius), center, float(voxel));
}

}  // namespace

TEST_CASE("Intensity mean and standard deviation are those of the voxels inside the surface") {
    openvdb::initialize();
    const Image image = ramp(0.5);
    const IntensityStatistics found = measure_intensity(image, *sphere(5, {10, 10, 10}, 0.25));
    CHECK(double(found.voxels) == Approx(4.0 / 3 * M_PI * 1000).epsilon(0.02));
    CHECK(found.mean == Approx(100020).margin(0.01));
    // A coordinate of a random position in a ball of radius R has the variance R^2 / 5; here R is 10 voxels.
    CHECK(found.standard_deviation == Approx(std::sqrt(100.0 / 5)).epsilon(0.02));
    CHECK(count_voxels_around(image, *sphere(5, {10, 10, 10}, 0.25)) >= 20 * 20 * 20);
}

TEST_CASE("Only voxels within the image are measured, none for a surface outside of the image") {
    openvdb::initialize();
    const Image image = ramp(1);
    const IntensityStatistics half = measure_intensity(image, *sphere(8, {-0.5, 20, 20}, 0.5));
    CHECK(double(half.voxels) == Approx(2.0 / 3 * M_PI * 512).epsilon(0.05));
    CHECK(half.mean > 100000);
    const IntensityStatistics none = measure_intensity(image, *sphere(8, {-50, 20, 20}, 0.5));
    CHECK(none.voxels == 0);
    CHECK(none.mean == 0);
    CHECK(count_voxels_around(image, *sphere(8, {-50, 20, 20}, 0.5)) == 0);
}
