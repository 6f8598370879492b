#include <catch2/catch.hpp>
#include <cmath>

#include "covol/points.h"
#include "support/scratch.h"

using namespace covol;

namespace {

ImageGeometry small_image() {
    ImageGeometry geometry;
    geometry.size = {100, 80, 20};
    geometry.spacing = {0.1, 0.1, 1.0};
    return geometry;
}

PointCloud cloud_of(const std::vector<Vec3>& points, PointSpace space = PointSpace::World) {
    PointCloud cloud;
    cloud.points = points;
    cloud.space = space;
    cloud.reading = {space, PointOrder::XYZ};
    cloud.source = "cloud.csv";
    return cloud;
}

/// The result of check_inside(): the message of its error, or its warnings in brackets.
std::string verdict(const PointCloud& cloud, const ImageGeometry& geometry) {
    std::string warnings;
    RunContext run;
    run.log = [&](LogLevel level, const std::string& line) {
        if (level == LogLevel::Warning) warnings += "[" + line + "]";
    };
    const std::string error = message_of([&] { check_inside(cloud, geometry, run); });
    return error.empty() ? warnings : error;
}

bool contains(const std::string& message, const std::string& part) {
    INFO(message);
    INFO(part);
    CHECK(message.find(part) != std::string::npos);
    return message.find(part) != std::string::npos;
}

/// Marks on an oblique closed line through an image whose voxel sizes and origin differ along each axis, in voxels.
std::vector<Vec3> marks() {
    std::vector<Vec3> points;
    for (int slice = 4; slice < 16; slice += 2)
        for (int n = 0; n < 24; ++n)
            points.push_back(
                {60.3 + 30.2 * std::cos(0.2618 * n), 45.1 + 25.3 * std::sin(0.2618 * n) + 0.37 * slice, double(slice)});
    return points;
}

}  // namespace

TEST_CASE("Points outside the image are counted, and the boxes of points and image are reported") {
    const ImageGeometry geometry = small_image();
    // The image extends over 10 x 8 x 20 world units. The centre of its first voxel is at 0.
    CHECK(verdict(cloud_of({{0, 0, 0}, {9.9, 7.9, 19}, {-0.05, -0.05, -0.5}}), geometry).empty());
    const std::string message = verdict(cloud_of({{1, 1, 1}, {1, 1, 20.5}, {0, -60, 0}}), geometry);
    contains(message, "cloud.csv: 2 of 3 points");
    contains(message, "points from (0, -60, 0) to (1, 1, 20.5)");
    contains(message, "image from (-0.05, -0.05, -0.5) to (9.95, 7.95, 19.5)");
    CHECK(message.find('`') == std::string::npos);
}

TEST_CASE("Each common error of interpretation is reported with the option that corrects it") {
    ImageGeometry geometry = small_image();
    const auto advice = [&](const std::vector<Vec3>& points, PointSpace space = PointSpace::World) {
        return verdict(cloud_of(points, space), geometry);
    };
    contains(advice({{15, 4, 3}}), "`points_order = zyx` would bring them inside (the order of the axes is reversed)");
    contains(advice({{90, 70, 15}}),
             "; `points_space = index` would bring them inside (they are voxels, not world units)");
    contains(advice({{15, 70, 90}}), "; `points_space = index, points_order = zyx` would");
    contains(advice({{-5, -3, 15}}),
             "; `points_space = ras` would bring them inside (they are in RAS, the image is in LPS)");
    contains(advice({{5000, 3000, 15000}, {2000, 1000, 3000}}),
             "; `points_scale = 0.001` would bring them inside (their unit");
    contains(advice({{-5000, -3000, 15000}, {-2000, -1000, 3000}}),
             "; `points_space = ras, points_scale = 0.001` would");
    contains(advice({{100, 80, 20}}),
             "; `points_space = index1` would bring them inside (they are voxels counted from 1)");
    contains(advice({{3, 70, 90}}, PointSpace::Index), "; `points_order = zyx` would bring");
    contains(advice({{100, 80, 20}}, PointSpace::Index), "; `points_space = index1` would bring");
    // In a hyperstack of two channels, Fiji counts the slice of a multi-point's position over all channels.
    contains(advice({{15, 70, 39}}, PointSpace::Index),
             "`points_channels = 2` would bring them inside (their slices count the channels");
    geometry.origin = {500, 600, 700};
    contains(advice({{5, 4, 10}, {1, 1, 1}}),
             "`points_space = local` would bring them inside (they leave out the image's origin)");
}

TEST_CASE("Interpretations that fit equally well are all reported") {
    const ImageGeometry geometry = small_image();
    // The points fit if they are read as voxels, or in world units with the axes reversed.
    const std::string message = verdict(cloud_of({{15, 4, 3}, {12, 3, 2}}), geometry);
    contains(message, "; `points_order = zyx` would");
    contains(message, "or `points_space = index` would");
    contains(message, "several interpretations are possible");
}

TEST_CASE("World points and an image without spacing: the option spacing is suggested, or a warning is given") {
    ImageGeometry geometry = small_image();
    geometry.spacing = {1, 1, 1};
    geometry.spacing_known = false;
    contains(verdict(cloud_of({{500, 90, 90}, {-3000, 3, 3}}), geometry), "`spacing = sx,sy,sz`");
    contains(verdict(cloud_of({{5, 9, 9}}), geometry),
             "[cloud.csv: the points are in world units, but the image states no spacing");
    CHECK(verdict(cloud_of({{5, 9, 9}}, PointSpace::Index), geometry).empty());
}

TEST_CASE("Misinterpreted points inside the image are recognised by their voxel centres, with a warning") {
    ImageGeometry geometry;
    geometry.size = {400, 400, 400};  // every interpretation lies within it
    geometry.spacing = {0.35, 0.4, 0.7};
    geometry.origin = {-1.11, -2.33, -3.77};
    std::vector<Vec3> voxels, world, reversed;
    for (const Vec3& p : marks()) {
        voxels.push_back({std::round(p[0]), std::round(p[1]), p[2]});
        world.push_back(geometry.index_to_world(p));
        reversed.push_back({world.back()[2], world.back()[1], world.back()[0]});
    }
    contains(verdict(cloud_of(voxels), geometry), "`points_space = index` would put them on voxel centres");
    contains(verdict(cloud_of(reversed), geometry), "`points_order = zyx` would put them on voxel centres");
    CHECK(verdict(cloud_of(world), geometry).empty());
    // If the user has stated the space of the points, there is no warning.
    PointCloud stated = cloud_of(voxels);
    stated.stated = true;
    CHECK(verdict(stated, geometry).empty());
}

TEST_CASE("Reading a file again with the suggested options gives the correct positions") {
    const Scratch scratch;
    ImageGeometry geometry;
    geometry.size = {128, 96, 20};
    geometry.spacing = {0.5, 0.25, 2};
    geometry.origin = {-7, 11, 130};
    std::vector<Vec3> world;
    for (const Vec3& p : marks()) world.push_back(geometry.index_to_world(p));

    const auto check = [&](const ReadPointsOptions& options, const std::string& advice, auto&& as_written) {
        INFO(advice);
        std::vector<Vec3> written;
        for (const Vec3& p : world) written.push_back(as_written(p));
        const std::string path = scratch.path("marks.xyz");
        write_points(path, written);
        contains(verdict(read_points(path), geometry), "; " + advice + " would bring them inside");
        const PointCloud corrected = read_points(path, options);
        CHECK(verdict(corrected, geometry).empty());
        const std::vector<Vec3> back = to_world(corrected, geometry);
        for (std::size_t n = 0; n < world.size(); ++n)
            for (int a = 0; a < 3; ++a) REQUIRE(back[n][a] == Approx(world[n][a]));
    };
    check({PointSpace::Unstated, PointOrder::ZYX}, "`points_order = zyx`", [](const Vec3& p) {
        return Vec3{p[2], p[1], p[0]};
    });
    check({PointSpace::Index}, "`points_space = index`", [&](const Vec3& p) { return geometry.world_to_index(p); });
    check({PointSpace::Ras}, "`points_space = ras`", [](const Vec3& p) { return Vec3{-p[0], -p[1], p[2]}; });
    check({PointSpace::Local}, "`points_space = local`", [&](const Vec3& p) {
        return Vec3{p[0] - geometry.origin[0], p[1] - geometry.origin[1], p[2] - geometry.origin[2]};
    });
    check({PointSpace::Unstated, PointOrder::Unstated, 1e-3}, "`points_scale = 0.001`", [](const Vec3& p) {
        return Vec3{1e3 * p[0], 1e3 * p[1], 1e3 * p[2]};
    });
    check({PointSpace::Index, PointOrder::ZYX}, "`points_space = index, points_order = zyx`", [&](const Vec3& p) {
        const Vec3 i = geometry.world_to_index(p);
        return Vec3{i[2], i[1], i[0]};
    });
}

TEST_CASE("Coordinates that are small in the image's unit are not taken for voxel indices") {
    // The points are in millimetres. Read as voxels, all of them would lie in the first voxel.
    ImageGeometry geometry = small_image();
    geometry.spacing = {1e-4, 1e-4, 5e-4};
    std::vector<Vec3> points;
    for (const Vec3& p : marks()) points.push_back(geometry.index_to_world(p));
    CHECK(verdict(cloud_of(points), geometry).empty());
    // If they lie outside of the image, voxels are not suggested either.
    for (Vec3& p : points) p[0] += 1;
    CHECK(verdict(cloud_of(points), geometry).find("points_space = index") == std::string::npos);
}

TEST_CASE("Marks in a single slice cause no warning about their interpretation") {
    ImageGeometry geometry = small_image();
    geometry.spacing = {0.1, 0.1, 0.4};
    std::vector<Vec3> points;
    for (int n = 0; n < 24; ++n)
        points.push_back({4.03 + 2.02 * std::cos(0.2618 * n), 4.01 + 2.53 * std::sin(0.2618 * n), 3});
    CHECK(verdict(cloud_of(points), geometry).empty());
}
