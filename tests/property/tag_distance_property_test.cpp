// Tests of the choice of the tag distance D on real clouds, and of leaks at that D. They need COVOL_DATA.
#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <iostream>

#include "covol/band.h"
#include "covol/distance.h"
#include "covol/points.h"

using namespace covol;

namespace {

struct RealCloud {
    const char* path;
    double voxel_size;
    std::vector<Vec3> exterior_seeds;
    double low, high;  ///< D, voxels
};

}  // namespace

TEST_CASE("The tag distance of real scans lies in the expected range, and the tagged interior does not leak") {
    const char* data = std::getenv("COVOL_DATA");
    if (!data) {
        std::cout << "SKIPPED: COVOL_DATA does not name the folder of test data\n";
        return;
    }
    const std::vector<RealCloud> clouds = {
        // The ball lacks a cap, which leaves a hole of radius 21 to 23 mm (voxels); D must close it.
        {"clouds/apc_rawlings_baseball.ply", 0.001, {}, 21.0, 24.5},
        {"clouds/apc_fitness_gear_3lb_dumbbell.ply", 0.001, {}, 10.0, 15.0},
        // D is 1.8 mean spacings if the points enclose nothing. The nuclei are 4.1 apart, so that this is 3.7 voxels.
        {"clouds/drosophila_embryo_nuclei.xyz", 2.0, {}, 2.3, 3.7},
        {"phantoms/embryo_ve_points.ply", 0.35, {{89.6, 89.6, 28.5}}, 2.0, 3.2},
        {"phantoms/embryo_exe_points.ply", 0.35, {}, 1.8, 3.2},
    };
    for (const RealCloud& cloud : clouds) {
        INFO(cloud.path);
        const std::vector<Vec3> points = read_points(std::string(data) + "/" + cloud.path).points;
        const double h = cloud.voxel_size;
        const Domain domain = make_domain(bounding_box(points, 30 * h), h);
        const double chosen = choose_tag_distance(points, domain, cloud.exterior_seeds).tag_distance;
        CHECK(chosen >= cloud.low * h);
        CHECK(chosen <= cloud.high * h);
        const DistanceResult tube = compute_distance(points, domain, {chosen + 4 * h});
        const BandReport report = tag_interior(*tube.grid, {chosen, cloud.exterior_seeds}).report;
        CHECK_FALSE(report.leaks);
        CHECK(report.core_volume > 0);
    }
}

TEST_CASE("The tag distance of an open cloud is chosen with the reason that there is no closed structure") {
    const char* data = std::getenv("COVOL_DATA");
    if (!data) {
        std::cout << "SKIPPED: COVOL_DATA does not name the folder of test data\n";
        return;
    }
    const std::vector<Vec3> points = read_points(std::string(data) + "/clouds/autzen_stadium.ply").points;
    const Domain domain = make_domain(bounding_box(points, 30), 4.0);
    CHECK(choose_tag_distance(points, domain, {}).reason.find("no closed structure") != std::string::npos);
}
