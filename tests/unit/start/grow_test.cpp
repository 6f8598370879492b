// Tests of starts inside an object or around one: which of them grow, and to what size.
#include "start/grow.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "covol/start.h"
#include "support/clouds.h"

using namespace covol;

namespace {

/// An image of n^3 voxels with edges of 1: 100 outside, `inside` where the shape is negative, a soft border as wide as
/// a voxel, and noise.
Image image_of(int n, const std::function<double(const Vec3&)>& shape, double inside, double noise, unsigned seed) {
    ImageGeometry geometry;
    geometry.size = {n, n, n};
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, noise > 0 ? noise : 1);
    std::vector<float> values;
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const double fraction = std::clamp(0.5 - shape({double(i), double(j), double(k)}), 0.0, 1.0);
                values.push_back(float(100 + (inside - 100) * fraction + (noise > 0 ? normal(random) : 0.0)));
            }
    return Image::from_values(geometry, values.data());
}

std::function<double(const Vec3&)> ellipsoid(const Vec3& center, const Vec3& radii) {
    return [=](const Vec3& x) {
        double along = 0, slope = 0;
        for (int a = 0; a < 3; ++a) {
            const double p = (x[a] - center[a]) / radii[a];
            along += p * p;
            slope += p * p / (radii[a] * radii[a]);
        }
        along = std::sqrt(along);
        return slope > 0 ? along * (along - 1) / std::sqrt(slope) : -std::min({radii[0], radii[1], radii[2]});
    };
}

}  // namespace

TEST_CASE("A sphere inside a bright or dark object grows to its edges, from several positions and with noise") {
    const Vec3 center{24.3, 23.6, 24.9}, radii{14, 11, 15};
    const double truth = 4.0 / 3 * M_PI * radii[0] * radii[1] * radii[2];
    for (const double inside : {180.0, 20.0})
        for (const double noise : {0.0, 10.0, 30.0})
            for (const Vec3& off : {Vec3{0, 0, 0}, Vec3{6, 0, 0}, Vec3{-3, 4, 6}}) {
                INFO("inside " << inside << ", noise " << noise << ", seed off by " << off[0] << " " << off[1] << " "
                               << off[2]);
                const Image image = image_of(50, ellipsoid(center, radii), inside, noise, 3);
                const Domain domain = make_domain(image.geometry().world_box(), 1);
                const FloatGridPtr seed =
                    start_from_sphere(domain, {center[0] + off[0], center[1] + off[1], center[2] + off[2]}, 3.5);
                const detail::GrownStart grown = detail::grow_to_edges(image, *seed, 1, {});
                INFO(grown.why);
                REQUIRE(grown.level_set);
                CHECK(test::negative_volume(*grown.level_set) == Approx(truth).epsilon(0.1));
            }
}

TEST_CASE("A start around an object, at its edge or in an empty image does not grow") {
    const Vec3 center{24, 24, 24};
    const Image image = image_of(50, ellipsoid(center, {10, 10, 10}), 180, 5, 1);
    const Domain domain = make_domain(image.geometry().world_box(), 1);
    CHECK_FALSE(detail::grow_to_edges(image, *start_from_sphere(domain, center, 16), 1, {}).level_set);
    CHECK_FALSE(detail::grow_to_edges(image, *start_from_sphere(domain, center, 10), 1, {}).level_set);
    const Image empty = image_of(
        50, [](const Vec3&) { return 1.0; }, 180, 5, 1);
    CHECK_FALSE(detail::grow_to_edges(empty, *start_from_sphere(domain, center, 6), 1, {}).level_set);
}
