#include "covol/band.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>

#include "covol/distance.h"
#include "covol/error.h"
#include "support/clouds.h"

using namespace covol;
using namespace covol::test;

namespace {

constexpr double kPi = 3.14159265358979323846;
double ball(double radius) { return 4.0 / 3.0 * kPi * radius * radius * radius; }

FloatGridPtr tube(const std::vector<Vec3>& points, const Domain& domain, double radius) {
    return compute_distance(points, domain, {radius}).grid;
}

/// The points without those above z.
std::vector<Vec3> without_cap(std::vector<Vec3> points, double z) {
    points.erase(std::remove_if(points.begin(), points.end(), [z](const Vec3& p) { return p[2] > z; }), points.end());
    return points;
}

const Domain kDomain = make_domain({{-32, -32, -32}, {32, 32, 32}}, 1.0);

}  // namespace

TEST_CASE("Tagging the points of a sphere encloses a ball of radius r + D") {
    const double r = 20, tag_distance = 2.5;
    const FloatGridPtr d = tube(sphere_cloud(40000, r, 1), kDomain, 8);
    const BandResult result = tag_interior(*d, {tag_distance, {}});
    CHECK(result.report.enclosed_volume == Approx(ball(r + tag_distance)).epsilon(0.01));
    CHECK(result.report.core_volume == Approx(ball(r - tag_distance)).epsilon(0.01));
    CHECK_FALSE(result.report.leaks);
    CHECK(result.report.holding_distance == 0);
    CHECK(result.grid->getName() == "band");
    CHECK(result.grid->background() == 3.0F);
    CHECK(std::int64_t(result.grid->activeVoxelCount()) == result.report.active_voxels);
    CHECK(negative_volume(*result.grid) == Approx(result.report.enclosed_volume).epsilon(1e-6));
    CHECK(domain_of(*result.grid) == kDomain);

    SECTION("u0 is the signed distance to the tagged surface, clamped to three voxels") {
        double worst = 0;
        int inactive_in_band = 0;
        for (int i = kDomain.min[0]; i <= kDomain.max[0]; ++i)
            for (int j = kDomain.min[1]; j <= kDomain.max[1]; ++j)
                for (int k = kDomain.min[2]; k <= kDomain.max[2]; ++k) {
                    const Vec3 x = world_of(kDomain, {i, j, k});
                    const double exact = std::clamp(std::hypot(x[0], x[1], x[2]) - (r + tag_distance), -3.0, 3.0);
                    worst = std::max(worst, std::abs(exact - result.grid->tree().getValue({i, j, k})));
                    if (std::abs(exact) < 2.9 && !result.grid->tree().isValueOn({i, j, k})) ++inactive_in_band;
                }
        CHECK(worst <= 0.25);  // the cloud is random: the tagged surface is up to this far from the sphere
        CHECK(inactive_in_band == 0);
    }
    SECTION("the enclosed core next to d = D is deep inside") {
        CHECK(value_at(*result.grid, {r - tag_distance - 0.5, 0, 0}) == -3.0F);
        CHECK(value_at(*result.grid, {0, 0, 0}) == -3.0F);
    }
    SECTION("active voxels are those with d up to D + 3 h") {
        int wrong = 0;
        for (auto value = d->cbeginValueOn(); value; ++value)
            wrong += result.grid->tree().isValueOn(value.getCoord()) != (*value <= float(tag_distance + 3));
        CHECK(wrong == 0);
    }
}

TEST_CASE("The tagged surface of densely sampled planes is exact to a hundredth of a voxel") {
    // The faces of a closed box, sampled by a lattice of points denser than the voxels, are planes.
    std::vector<Vec3> points;
    for (double s = -20; s <= 20; s += 0.25)
        for (double t = -20; t <= 20; t += 0.25)
            for (const double end : {-20.0, 20.0}) {
                points.push_back({end, s, t});
                points.push_back({s, end, t});
                points.push_back({s, t, end});
            }
    const BandResult result = tag_interior(*tube(points, kDomain, 8), {2.3, {}});
    double worst = 0;
    for (double x = 19.5; x <= 25.5; x += 1)
        for (double y = -10.5; y < 11; y += 1) {
            const double exact = std::clamp(x - 22.3, -3.0, 3.0);
            worst = std::max(worst, std::abs(exact - value_at(*result.grid, {x, y, 3.5})));
            worst = std::max(worst, std::abs(exact - value_at(*result.grid, {y, 3.5, -x})));
        }
    CHECK(worst <= 0.01);
}

TEST_CASE("An exterior seed opens a cavity") {
    std::vector<Vec3> points = sphere_cloud(40000, 24, 1);
    const std::vector<Vec3> inner = sphere_cloud(15000, 12, 2);
    points.insert(points.end(), inner.begin(), inner.end());
    const FloatGridPtr d = tube(points, kDomain, 8);
    const BandResult closed = tag_interior(*d, {2.5, {}});
    CHECK(closed.report.enclosed_volume == Approx(ball(26.5)).epsilon(0.01));
    const BandResult open = tag_interior(*d, {2.5, {{0, 0, 0}}});
    CHECK(open.report.enclosed_volume == Approx(ball(26.5) - ball(9.5)).epsilon(0.01));
    CHECK(value_at(*open.grid, {0.5, 0.5, 0.5}) == 3.0F);
    CHECK(value_at(*open.grid, {0.5, 0.5, 18}) == -3.0F);
    CHECK(negative_volume(*open.grid) == Approx(open.report.enclosed_volume).epsilon(1e-6));
}

TEST_CASE("Exterior seeds closer than D to the points or outside of the domain are rejected") {
    const FloatGridPtr d = tube(sphere_cloud(5000, 20, 1), kDomain, 8);
    const auto message = [&](const Vec3& seed) -> std::string {
        try {
            (void)tag_interior(*d, {2.5, {seed}});
        } catch (const Error& e) {
            CHECK(e.code() == Errc::InvalidInput);
            return e.what();
        }
        return {};
    };
    CHECK(message({20, 0, 0}).find("the tag distance, 2.5") != std::string::npos);
    CHECK(message({40, 0, 0}).find("in the domain") != std::string::npos);
}

TEST_CASE("A leak is reported with the tag distance that closes it") {
    // A cap of radius sqrt(20^2 - 18^2) = 8.7 is missing.
    const std::vector<Vec3> points = without_cap(sphere_cloud(40000, 20, 3), 18);
    const FloatGridPtr d = tube(points, kDomain, 14);
    const BandResult leaking = tag_interior(*d, {3.0, {}});
    CHECK(leaking.report.leaks);
    CHECK(leaking.report.core_volume < 100);
    CHECK(leaking.report.holding_distance > 6.0);
    CHECK(leaking.report.holding_distance < 10.0);
    const BandResult holding = tag_interior(*d, {leaking.report.holding_distance, {}});
    CHECK_FALSE(holding.report.leaks);
    CHECK(holding.report.core_volume > 1000);

    SECTION("in a narrow tube no such tag distance is found") {
        const BandResult narrow = tag_interior(*tube(points, kDomain, 6.5), {3.0, {}});
        CHECK(narrow.report.leaks);
        CHECK(narrow.report.holding_distance == 0);
    }
}

TEST_CASE("A body without a core, smaller than D, is not reported as a leak") {
    // D is larger than the sphere's radius, so that no core remains. A smaller D still finds the core.
    const std::vector<Vec3> points = sphere_cloud(3000, 4, 1);
    const BandResult result = tag_interior(*tube(points, kDomain, 9), {5.0, {}});
    CHECK(result.report.core_volume == 0);
    CHECK_FALSE(result.report.leaks);
}

TEST_CASE("Voxels beyond the domain are outside, and the flood fill enters at the domain's end") {
    // The domain cuts the sphere, whose wall reaches the domain's end.
    const Domain half = make_domain({{-32, -32, 0}, {32, 32, 32}}, 1.0);
    const BandResult result = tag_interior(*tube(sphere_cloud(40000, 20, 1), half, 8), {2.5, {}});
    int inside_beyond = 0;
    for (auto value = result.grid->tree().cbeginValueAll(); value; ++value)
        if (value.getCoord().z() < half.min[2] && *value < 0) ++inside_beyond;
    CHECK(inside_beyond == 0);
    CHECK(result.report.core_volume == 0);  // the flood enters at the domain's end
}

TEST_CASE("A small cloud in a domain of 8192^3 voxels is tagged") {
    const Domain large = make_domain({{-4096, -4096, -4096}, {4096, 4096, 4096}}, 1.0);
    const BandResult result = tag_interior(*tube(sphere_cloud(8000, 12, 1, {3000, -3000, 500}), large, 7), {2.5, {}});
    CHECK(result.report.enclosed_volume == Approx(ball(14.5)).epsilon(0.02));
    CHECK(value_at(*result.grid, {3000, -3000, 500}) == -3.0F);
    CHECK(value_at(*result.grid, {0, 0, 0}) == 3.0F);
}

TEST_CASE("The interior far from the surface consists of tiles, not of leaves") {
    const Domain wide = make_domain({{-80, -80, -80}, {80, 80, 80}}, 1.0);
    const BandResult result = tag_interior(*tube(sphere_cloud(150000, 70, 1), wide, 6), {2.5, {}});
    CHECK(value_at(*result.grid, {0.5, 0.5, 0.5}) == -3.0F);
    CHECK(result.grid->tree().probeConstLeaf({0, 0, 0}) == nullptr);
    CHECK(negative_volume(*result.grid) == Approx(ball(72.5)).epsilon(0.01));
}

TEST_CASE("tag_interior() is bitwise identical for 1, 2 and 8 threads") {
    const FloatGridPtr d = tube(sphere_cloud(3000, 20, 1), kDomain, 8);
    RunContext run;
    run.threads = 1;
    const BandResult one = tag_interior(*d, {2.5, {}}, run);
    for (const int threads : {2, 8}) {
        run.threads = threads;
        CHECK(identical(*one.grid, *tag_interior(*d, {2.5, {}}, run).grid));
    }
}

TEST_CASE("A tube that is too narrow, a missing tube and an invalid D are rejected") {
    const FloatGridPtr d = tube({{0, 0, 0}}, kDomain, 5);
    CHECK_THROWS_AS(tag_interior(*d, {2.5, {}}), Error);
    CHECK_THROWS_AS(tag_interior(*make_grid(kDomain, 5.0F, "distance"), {2.0, {}}), Error);
    CHECK_THROWS_AS(tag_interior(*d, {0.0, {}}), Error);
    CHECK_NOTHROW(tag_interior(*d, {2.0, {}}));
}

TEST_CASE("The tag distance is chosen from the cloud") {
    const auto leaks_with = [](const std::vector<Vec3>& points, const TagDistanceChoice& choice) {
        const FloatGridPtr d = tube(points, kDomain, choice.tag_distance + 4);
        const BandReport report = tag_interior(*d, {choice.tag_distance, {}}).report;
        return report.leaks || report.core_volume == 0;
    };
    SECTION("dense points: close to the voxel size") {
        const std::vector<Vec3> points = sphere_cloud(40000, 20, 1);
        const TagDistanceChoice choice = choose_tag_distance(points, kDomain, {});
        CHECK(choice.tag_distance >= 1.5);
        CHECK(choice.tag_distance <= 3.0);
        CHECK_FALSE(leaks_with(points, choice));
        CHECK(choice.reason.find("core") != std::string::npos);
    }
    SECTION("300 random points: large enough to close their largest gap") {
        const std::vector<Vec3> points = sphere_cloud(300, 20, 2);
        const TagDistanceChoice choice = choose_tag_distance(points, kDomain, {});
        CHECK(choice.tag_distance < 10.0);
        CHECK_FALSE(leaks_with(points, choice));
    }
    SECTION("a missing cap: about its radius") {
        // The radius of the hole is sqrt(20^2 - 16^2) = 12.
        const std::vector<Vec3> points = without_cap(sphere_cloud(40000, 20, 3), 16);
        const TagDistanceChoice choice = choose_tag_distance(points, kDomain, {});
        CHECK(choice.tag_distance > 10.5);
        CHECK(choice.tag_distance < 14.0);
        CHECK_FALSE(leaks_with(points, choice));
    }
    SECTION("a seed in the cavity: from the core of the shell") {
        std::vector<Vec3> points = sphere_cloud(40000, 26, 4);
        const std::vector<Vec3> inner = sphere_cloud(10000, 12, 5);
        points.insert(points.end(), inner.begin(), inner.end());
        const TagDistanceChoice choice = choose_tag_distance(points, kDomain, {{0, 0, 0}});
        CHECK(choice.tag_distance < 3.5);
        const BandReport report = tag_interior(*tube(points, kDomain, 8), {choice.tag_distance, {{0, 0, 0}}}).report;
        CHECK(report.core_volume > 0.5 * (ball(26) - ball(12)));
    }
    SECTION("a sheet without an inside: from the spacing, as the reason states") {
        const TagDistanceChoice choice =
            choose_tag_distance(box_cloud(4000, {{-25, -25, 0}, {25, 25, 0.01}}, 6), kDomain, {});
        CHECK(choice.reason.find("spacing") != std::string::npos);
        CHECK(choice.tag_distance == Approx(1.5));  // the minimum of 1.5 voxels; 1.8 times the spacing of 0.4 is less
    }
    SECTION("a single point: at least 1.5 voxels") {
        CHECK(choose_tag_distance({{1, 1, 1}}, kDomain, {}).tag_distance >= 1.5);
    }
}
