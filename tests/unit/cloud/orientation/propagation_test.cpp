#include "cloud/orientation/propagation.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "support/clouds.h"

using namespace covol;

namespace {

std::size_t count_along(const std::vector<Vec3>& normals, const std::vector<Vec3>& directions, double cosine) {
    std::size_t count = 0;
    for (std::size_t n = 0; n < normals.size(); ++n) {
        double dot = 0;
        for (std::size_t a = 0; a < 3; ++a) dot += normals[n][a] * directions[n][a];
        count += dot > cosine;
    }
    return count;
}

/// Uniform random points on a square with edges of length 1 in the plane at height z.
std::vector<Vec3> square(std::size_t count, double z, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(0, 1);
    std::vector<Vec3> points(count);
    for (Vec3& p : points) p = {place(random), place(random), z};
    return points;
}

}  // namespace

TEST_CASE("propagated_normals: all normals of two separate spheres point outwards") {
    std::vector<Vec3> points = test::sphere_cloud(4000, 1, 1), outward = points;
    for (const Vec3& p : test::sphere_cloud(1000, 0.5, 2)) {
        points.push_back({p[0] + 3, p[1], p[2]});
        outward.push_back({2 * p[0], 2 * p[1], 2 * p[2]});
    }
    const CloudScale scale = measure_cloud_scale(points);
    const std::vector<Vec3> normals = cloud::propagated_normals(points, scale, scale.spacing);
    CHECK(count_along(normals, outward, 0.9) == points.size());
}

TEST_CASE("propagated_normals: normals on both sides of a plate three spacings thick point outwards") {
    constexpr std::size_t kCount = 5000;
    const double spacing = 1 / std::sqrt(double(kCount));
    std::vector<Vec3> points = square(kCount, 0, 1);
    const std::vector<Vec3> top = square(kCount, 3 * spacing, 2);
    points.insert(points.end(), top.begin(), top.end());
    std::vector<Vec3> towards;
    for (const Vec3& p : points) towards.push_back({0, 0, p[2] > 0 ? 1.0 : -1.0});
    const CloudScale scale = measure_cloud_scale(points);
    const std::vector<Vec3> normals = cloud::propagated_normals(points, scale, scale.spacing, towards);
    CHECK(count_along(normals, towards, 0.9) > 0.99 * double(points.size()));
}

TEST_CASE("propagated_normals: an open sheet faces the side from which most of its points are seen") {
    const std::vector<Vec3> points = square(3000, 0, 3);
    const CloudScale scale = measure_cloud_scale(points);
    for (const double side : {-1.0, 1.0}) {
        std::vector<Vec3> towards(points.size(), Vec3{0, 0, side});
        for (std::size_t n = 0; n < towards.size(); n += 3) towards[n] = {0, 0, n % 2 == 0 ? -side : 0};
        const std::vector<Vec3> normals = cloud::propagated_normals(points, scale, scale.spacing, towards);
        CHECK(count_along(normals, std::vector<Vec3>(points.size(), Vec3{0, 0, side}), 0.99) == points.size());
    }
}

TEST_CASE("plane_normals: with noise of one spacing the mean cosine to the plane's normal exceeds 0.95") {
    std::vector<Vec3> points = square(6000, 0, 4);
    const double spacing = 1 / std::sqrt(double(points.size()));
    std::mt19937 random(5);
    std::normal_distribution<double> noise(0, spacing);
    for (Vec3& p : points) p[2] = noise(random);
    CloudScale scale;
    scale.spacing = scale.noise = spacing;
    double worst = 1, sum = 0;
    for (const Vec3& n : cloud::plane_normals(points, scale)) {
        worst = std::min(worst, std::abs(n[2]));
        sum += std::abs(n[2]);
    }
    CHECK(sum / double(points.size()) > 0.95);
    CHECK(worst > 0.2);
}
