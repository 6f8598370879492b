#include "meshing/level_set_distance.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "covol/start.h"
#include "covol/surface.h"

using namespace covol;

TEST_CASE("Distances beyond the band are equal for few and many points, and within 0.12 voxels of a sphere's") {
    const double h = 0.25, radius = 4;
    const Domain domain = make_domain({{-6, -6, -6}, {6, 6, 6}}, h);
    const FloatGridPtr surface = extract_surface(*start_from_sphere(domain, {0.1, -0.2, 0.05}, radius));
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform(-30, 30);
    std::vector<Vec3> points{{0.1, -0.2, 0.05}, {0, 0, 0}, {3.9, 0, 0}, {40, 0, 0}, {0, -5.9, 0.3}, {1e4, 1e4, -1e4}};
    const std::size_t few = points.size();
    const std::vector<double> of_few = detail::distances_to(*surface, points);
    for (int n = 0; n < 5000; ++n) points.push_back({uniform(random), uniform(random), uniform(random)});
    const std::vector<double> of_many = detail::distances_to(*surface, points);
    for (std::size_t n = 0; n < few; ++n) CHECK(of_few[n] == of_many[n]);
    for (std::size_t n = 0; n < points.size(); ++n) {
        const double exact = std::abs(std::hypot(points[n][0] - 0.1, points[n][1] + 0.2, points[n][2] - 0.05) - radius);
        // Beyond the band, the distance is that to the nearest point at which an edge of the lattice cuts the surface.
        REQUIRE(of_many[n] > exact - 0.05 * h);
        REQUIRE(of_many[n] < exact + 0.12 * h);
    }
}

TEST_CASE("A change of sign that is not a cut edge does not count as the surface") {
    const double h = 0.25;
    const Domain domain = make_domain({{-6, -6, -6}, {6, 6, 6}}, h);
    const FloatGridPtr surface = extract_surface(*start_from_sphere(domain, {0, 0, 0}, 4));
    // At the cut end of a body, a voxel deep inside may be next to one outside. This change of sign is no cut edge.
    const openvdb::Coord apart(80, 80, 80);
    surface->tree().setValueOn(apart, float(-2.5 * h));
    const openvdb::Vec3d at = surface->indexToWorld(apart + openvdb::Coord(2, 3, 1));
    std::vector<Vec3> points{{at[0], at[1], at[2]}};
    const double alone = detail::distances_to(*surface, points).front();
    points.resize(5000, points.front());
    CHECK(alone == detail::distances_to(*surface, points).front());
    CHECK(alone == Approx(at.length() - 4).margin(0.12 * h));
}
