#include "covol/scan_noise.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "covol/error.h"
#include "support/clouds.h"

using namespace covol;

namespace {

double mean_off_sphere(const std::vector<Vec3>& points, double radius) {
    double sum = 0;
    for (const Vec3& p : points) sum += std::abs(std::hypot(p[0], p[1], p[2]) - radius);
    return sum / double(points.size());
}

}  // namespace

TEST_CASE("measure_layer_thickness: 0 for a plane, up to 3/8 of the radius for points that fill space") {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> x(0, 1);
    std::vector<Vec3> plane(2000);
    for (Vec3& p : plane) p = {x(random), x(random), 0};
    CHECK(measure_layer_thickness(plane, 0.1) < 1e-9);
    const std::vector<Vec3> block = test::box_cloud(40000, {{0, 0, 0}, {1, 1, 1}}, 5);
    // 3/8 of the radius is the mean distance from a plane through the centre of a filled ball. The result is less,
    // because the least-squares plane fits better, and because some neighbourhoods extend beyond the block.
    CHECK(measure_layer_thickness(block, 0.1) < 0.0375);
    CHECK(measure_layer_thickness(block, 0.1) > 0.75 * 0.0375);
    CHECK(measure_layer_thickness({{0, 0, 0}, {1, 0, 0}}, 10) == 0);
    CHECK_THROWS_AS(measure_layer_thickness(block, 0), Error);
    CHECK_THROWS_AS(average_layers(block, -1), Error);
}

TEST_CASE("average_layers moves two layers of a sphere to their middle, and keeps a single layer") {
    // The radii are 0.98 and 1.02, so that the layers are 0.04 apart, more than twice the spacing of their points.
    std::vector<Vec3> points = test::sphere_cloud(40000, 0.98, 1);
    const std::vector<Vec3> outer = test::sphere_cloud(40000, 1.02, 2);
    points.insert(points.end(), outer.begin(), outer.end());
    const std::vector<Vec3> averaged = average_layers(points, 0.15);
    REQUIRE(averaged.size() == points.size());
    CHECK(mean_off_sphere(points, 1) == Approx(0.02));
    // A plane that is fitted to a cap lies below its top: with the weights of average_layers(), (1 - (r / radius)^2)^2
    // at a distance r, by radius^2 / 8 on a unit sphere, in each of two passes.
    const double sag = 0.15 * 0.15 / 4;
    CHECK(mean_off_sphere(averaged, 1) < 1.15 * sag);
    const std::vector<Vec3> thin = test::sphere_cloud(40000, 1, 3);
    CHECK(mean_off_sphere(average_layers(thin, 0.15), 1) == Approx(sag).epsilon(0.15));
}

TEST_CASE("choose_scan_voxel_size: curvature is not taken for noise, also with few points") {
    // With voxels of 4 spacings, the largest candidates, neighbourhoods with a radius of 2.5 voxels would contain
    // the whole sphere of 50 points. Its bend must not be taken for noise.
    for (const int count : {50, 100, 300, 1000}) {
        const std::vector<Vec3> few = test::sphere_cloud(count, 6, 1);
        const double spacing = 6 * std::sqrt(M_PI / count);
        INFO(count << " points");
        CHECK(choose_scan_voxel_size(few, spacing).voxel_size == Approx(spacing));
    }
}

TEST_CASE("choose_scan_voxel_size: two sides of a plate are not noise, but points that fill it are") {
    std::vector<Vec3> plate = test::box_cloud(8000, {{0, 0, 0}, {100, 100, 0}}, 5);
    const std::vector<Vec3> above = test::box_cloud(8000, {{0, 0, 5}, {100, 100, 5}}, 6);
    plate.insert(plate.end(), above.begin(), above.end());
    CHECK(choose_scan_voxel_size(plate, 1).voxel_size == Approx(1));
    // If the plate is filled, the mean distance of points from its middle plane is 5/4. The voxel size is the first
    // power of the square root of 2 of which 0.35 is more than this distance: 4.
    const std::vector<Vec3> filled = test::box_cloud(50000, {{0, 0, 0}, {100, 100, 5}}, 7);
    CHECK(choose_scan_voxel_size(filled, 1).voxel_size == Approx(4));
}

TEST_CASE("choose_scan_voxel_size: the spacing for a clean scan, coarser than the noise for a noisy one") {
    const std::vector<Vec3> clean = test::sphere_cloud(20000, 1, 1);
    const double spacing = 0.0125;
    CHECK(choose_scan_voxel_size(clean, spacing).voxel_size == Approx(spacing));
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0, 0.02);
    std::vector<Vec3> noisy = clean;
    for (Vec3& p : noisy) {
        const double r = 1 + noise(random);
        for (double& c : p) c *= r;
    }
    const ScanVoxelSize choice = choose_scan_voxel_size(noisy, spacing);
    CHECK(choice.voxel_size > 2 * spacing);
    CHECK(choice.voxel_size < 5 * spacing);
    // For normally distributed noise the mean distance from the surface is 0.8 sigma. A part of it is absorbed by the
    // fitted plane.
    CHECK(choice.thickness == Approx(0.8 * 0.02).epsilon(0.25));
    CHECK(choice.thickness <= 0.35 * choice.voxel_size);
}
