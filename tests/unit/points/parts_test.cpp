#include "points/parts.h"

#include <algorithm>
#include <catch2/catch.hpp>

#include "covol/points.h"
#include "support/clouds.h"

using namespace covol;
using namespace covol::cloud;

namespace {

constexpr double kEdge = 0.13;  // twice the spacing of 3,000 points on a ball of radius 1

std::vector<Vec3> joined(std::vector<Vec3> points, const std::vector<Vec3>& more) {
    points.insert(points.end(), more.begin(), more.end());
    return points;
}

}  // namespace

TEST_CASE("A cloud without gaps is one part") {
    const std::vector<Vec3> ball = test::sphere_cloud(3000, 1, 1);
    CHECK(largest_part_side(ball, 10, kEdge) == longest_side(bounding_box(ball)));
    CHECK(largest_part_side({{1, 2, 3}}, 10, kEdge) == 0);
    CHECK(largest_part(ball, 10, kEdge) == ball);
}

TEST_CASE("Distant parts of a cloud are measured one by one, by repeated division") {
    const std::vector<Vec3> ball = test::sphere_cloud(3000, 1, 2);
    const double side = longest_side(bounding_box(ball));
    // Two pairs of balls. After the first division, each pair is one part; it is divided into its balls later.
    std::vector<Vec3> cloud = joined(ball, test::sphere_cloud(3000, 0.9, 3, {500, 0, 0}));
    cloud = joined(cloud, test::sphere_cloud(3000, 0.8, 4, {1e5, 2e5, 0}));
    cloud = joined(cloud, test::sphere_cloud(3000, 0.7, 5, {1e5, 2e5, 300}));
    CHECK(largest_part_side(cloud, 192, kEdge) == side);
    std::vector<Vec3> part = largest_part(cloud, 192, kEdge), whole = ball;  // the part is in another order
    std::sort(part.begin(), part.end());
    std::sort(whole.begin(), whole.end());
    CHECK(part == whole);
}

TEST_CASE("Parts are not separated if the gap is narrower than a cell or a part is over half of the whole") {
    const std::vector<Vec3> ball = test::sphere_cloud(3000, 1, 2);
    const std::vector<Vec3> beside = joined(ball, test::sphere_cloud(3000, 1, 3, {3, 0, 0}));
    CHECK(largest_part_side(beside, 192, kEdge) == longest_side(bounding_box(beside)));
    const std::vector<Vec3> close = joined(ball, test::sphere_cloud(3000, 1, 3, {2.5, 0, 0}));
    CHECK(largest_part_side(close, 8, kEdge) == longest_side(bounding_box(close)));
    // The smaller ball is a part of its own, but the larger one is more than half as long as both together.
    const std::vector<Vec3> both = joined(test::sphere_cloud(9000, 2, 5), test::sphere_cloud(300, 0.1, 6, {3, 0, 0}));
    CHECK(largest_part_side(both, 20, kEdge) == longest_side(bounding_box(both)));
}
