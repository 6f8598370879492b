// Compares compute_distance() with brute force on random clouds of several kinds.
#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>

#include "covol/distance.h"
#include "support/clouds.h"

using namespace covol;
using namespace covol::test;

namespace {

std::vector<Vec3> random_cloud(unsigned seed) {
    std::mt19937 random(seed);
    const int count = 1 << std::uniform_int_distribution<int>(0, 13)(random);
    switch (seed % 4) {
        case 0: return sphere_cloud(count, 6.0, seed);
        case 1: return box_cloud(count, {{-7, -7, -7}, {7, 7, 7}}, seed);
        case 2: return box_cloud(count, {{-7, -7, 1}, {7, 7, 1.001}}, seed);  // a thin sheet
        default: return box_cloud(count, {{-9, -9, -9}, {-3, 9, 9}}, seed);   // partly outside the domain
    }
}

}  // namespace

TEST_CASE("compute_distance() is within 0.01 h of brute force on average, 0.3 h at most") {
    for (unsigned seed = 0; seed < 24; ++seed) {
        INFO("seed " << seed);
        const std::vector<Vec3> points = random_cloud(seed);
        const double h = 0.25 + 0.01 * seed;
        const Domain domain = make_domain({{-8, -8, -8}, {8, 8, 8}}, h);
        const double radius = (2 + seed % 7) * h;
        const DistanceResult result = compute_distance(points, domain, {radius});
        REQUIRE(result.report.active_voxels > 0);
        std::mt19937 random(seed);
        double sum = 0, worst = 0, minimum = 0;
        int samples = 0;
        const std::int64_t every = std::max<std::int64_t>(1, result.report.active_voxels / 2000);
        for (auto value = result.grid->cbeginValueOn(); value; ++value) {
            if (std::int64_t(random() % std::uint32_t(every)) != 0) continue;
            const double error = *value - brute_force_distance(points, world_of(domain, value.getCoord()));
            minimum = std::min(minimum, error);
            worst = std::max(worst, error);
            sum += std::abs(error);
            ++samples;
        }
        CHECK(sum / samples <= 0.01 * h);
        CHECK(worst <= 0.3 * h);
        // No value is less than the true distance but by rounding, because each is the distance to some point.
        CHECK(minimum >= -1e-4 * h);
    }
}
