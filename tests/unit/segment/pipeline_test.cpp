#include "covol/pipeline.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <optional>

#include "covol/error.h"
#include "covol/surface.h"
#include "support/scratch.h"

using namespace covol;

namespace {

constexpr double kRadius = 8.0;

std::vector<Vec3> sphere_points(int count) {
    std::vector<Vec3> points;
    const double golden = std::acos(-1.0) * (3 - std::sqrt(5.0));
    for (int n = 0; n < count; ++n) {
        const double z = 1 - (2.0 * n + 1) / count, r = std::sqrt(1 - z * z);
        points.push_back({kRadius * r * std::cos(golden * n), kRadius * r * std::sin(golden * n), kRadius * z});
    }
    return points;
}

Image ball_image(double spacing) {
    ImageGeometry geometry;
    const int n = static_cast<int>(28 / spacing);
    geometry.size = {n, n, n};
    geometry.spacing = {spacing, spacing, spacing};
    geometry.origin = {-0.5 * spacing * (n - 1), -0.5 * spacing * (n - 1), -0.5 * spacing * (n - 1)};
    std::vector<float> values;
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const Vec3 w = geometry.index_to_world({double(i), double(j), double(k)});
                const double r = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
                values.push_back(static_cast<float>(std::clamp((kRadius - r) / spacing + 0.5, 0.0, 1.0)));
            }
    return Image::from_values(geometry, values.data());
}

double mean_radius(const TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& v : mesh.vertices)
        sum += std::sqrt(double(v[0]) * v[0] + double(v[1]) * v[1] + double(v[2]) * v[2]);
    return sum / static_cast<double>(mesh.vertices.size());
}

}  // namespace

TEST_CASE("segment: points alone give a closed sphere, and automatic choices are recorded") {
    constexpr double h = 0.8;
    SegmentOptions options;
    options.voxel_size = h;
    const SegmentResult result = reconstruct(sphere_points(1200), options);
    CHECK(result.report.surface.closed);
    CHECK(result.report.surface.genus == 0);
    CHECK(std::abs(mean_radius(result.mesh) - kRadius) < 0.03 * h);
    CHECK(result.report.fit.mean < 0.05 * h);
    CHECK(result.report.resolved.evolve.rho == 0);
    CHECK(result.report.resolved.evolve.delta.value() == Approx(0.25 * h));
    CHECK(result.report.automatic.count("rho") == 1);
    CHECK(result.report.automatic.count("guess") == 1);
    CHECK(result.report.guess.marks == 1200);
    CHECK(result.edge == nullptr);
    CHECK(result.report.point_count == 1200);
}

TEST_CASE("segment: image and points of a ball give its radius, and only a tagged start detects edges") {
    const Image image = ball_image(1.0);
    const SegmentResult result = segment(image, sphere_points(800));
    CHECK(result.report.domain.voxel_size == 1.0);
    CHECK(result.report.surface.closed);
    CHECK(std::abs(mean_radius(result.mesh) - kRadius) < 0.25);
    // A guess that the image corrects needs no edges, so that none are detected.
    CHECK(result.report.guidance.used);
    CHECK(result.edge == nullptr);
    CHECK_FALSE(result.report.resolved.edge.edge_k.has_value());
    SegmentOptions tagged;
    tagged.start = TagStart{};
    const SegmentResult flowed = segment(image, sphere_points(800), tagged);
    CHECK(flowed.edge != nullptr);
    CHECK(flowed.report.resolved.edge.edge_k.value() > 0);
}

TEST_CASE("segment: a start from a sphere evolves to the image edges without points") {
    const Image image = ball_image(1.0);
    SegmentOptions options;
    options.start = SphereStart{{0, 0, 0}, kRadius + 2};
    options.evolve.delta = 0.2;
    const SegmentResult result = segment(image, options);
    CHECK(result.report.resolved.evolve.follow);
    CHECK(result.report.resolved.evolve.theta == 0);
    CHECK(result.distance == nullptr);
    CHECK(std::abs(mean_radius(result.mesh) - kRadius) < 0.4);
}

TEST_CASE("segment: with unlimited attraction, a distant start reaches the points") {
    constexpr double h = 0.8;
    SegmentOptions options;
    options.voxel_size = h;
    options.start = SphereStart{{0, 0, 0}, kRadius + 4};
    options.margin = 8;
    options.evolve.attraction_range = 0;
    // The points are a voxel apart. With a larger delta, curvature would dominate between them.
    options.evolve.delta = 0.1 * h;
    const SegmentResult result = reconstruct(sphere_points(1200), options);
    CHECK(result.report.automatic.count("distance_tube") == 1);
    CHECK(std::abs(mean_radius(result.mesh) - kRadius) < 0.1 * h);
}

namespace {

/// An image of 80^3 voxels with edges of 1: an ellipsoid with the value 1 inside and 0 outside.
Image ellipsoid_image(const Vec3& semi_axes) {
    ImageGeometry geometry;
    geometry.size = {80, 80, 80};
    geometry.origin = {-39.5, -39.5, -39.5};
    std::vector<float> values;
    for (int k = 0; k < 80; ++k)
        for (int j = 0; j < 80; ++j)
            for (int i = 0; i < 80; ++i) {
                const Vec3 w = geometry.index_to_world({double(i), double(j), double(k)});
                double r2 = 0, slope2 = 0;
                for (int a = 0; a < 3; ++a) {
                    r2 += w[a] * w[a] / (semi_axes[a] * semi_axes[a]);
                    slope2 += w[a] * w[a] / std::pow(semi_axes[a], 4);
                }
                // Signed distance in voxels, to first order.
                const double depth = slope2 > 0 ? (1 - r2) / (2 * std::sqrt(slope2)) : 1;
                values.push_back(static_cast<float>(std::clamp(depth + 0.5, 0.0, 1.0)));
            }
    return Image::from_values(geometry, values.data());
}

SegmentResult from_sphere(const Image& image, double radius, std::optional<int> coarse_levels) {
    SegmentOptions options;
    options.start = SphereStart{{0, 0, 0}, radius};
    options.evolve.delta = 0.2;
    options.coarse_levels = coarse_levels;
    return segment(image, options);
}

}  // namespace

TEST_CASE("segment: with a coarse level, the surface is the same in less than half of the steps") {
    const Image image = ellipsoid_image({26, 18, 22});
    const SegmentResult fine = from_sphere(image, 32, 0), both = from_sphere(image, 32, {});
    REQUIRE(both.report.coarse.size() == 1);
    CHECK(both.report.coarse[0].why_not.empty());
    CHECK(fine.report.coarse.empty());
    CHECK(both.report.solve.steps < fine.report.solve.steps / 2);
    std::vector<Vec3> vertices;
    for (const auto& v : both.mesh.vertices) vertices.push_back({v[0], v[1], v[2]});
    const FitStatistics fit = measure_fit(vertices, fine.mesh);
    CHECK(fit.mean < 0.1);
    CHECK(fit.p95 < 0.2);
}

TEST_CASE("segment: without mesh and fields the surface is the same, and open holes are rejected") {
    const Image image = ellipsoid_image({26, 18, 22});
    SegmentOptions options;
    options.start = SphereStart{{0, 0, 0}, 32};
    const SegmentResult whole = segment(image, options);
    options.without_mesh = options.without_fields = true;
    const SegmentResult lean = segment(image, options);
    CHECK(lean.u == nullptr);
    CHECK(lean.edge == nullptr);
    CHECK(lean.mesh.triangles.empty());
    CHECK(lean.surface->tree().hasSameTopology(whole.surface->tree()));
    // A mesh that is not kept is not relaxed. Relaxation collapses slivers, which removes two triangles each time.
    CHECK(lean.report.mesh.triangles == whole.report.mesh.triangles + 2 * whole.report.mesh.collapses);
    CHECK(lean.report.surface.volume == Approx(whole.report.surface.volume).epsilon(3e-4));  // not relaxed
    CHECK(lean.report.surface.genus == 0);
    options.holes.policy = Holes::Open;
    CHECK_THROWS_WITH(segment(image, options), Catch::Contains("without_mesh"));
}

TEST_CASE("segment: a body too thin for the coarse level is not lost") {
    // A flat ellipsoid, four voxels thick at its centre, which is two voxels at the coarse level.
    const Image image = ellipsoid_image({24, 24, 2});
    const SegmentResult fine = from_sphere(image, 28, 0), both = from_sphere(image, 28, {});
    CHECK(both.report.surface.closed);
    CHECK(both.report.surface.volume == Approx(fine.report.surface.volume).epsilon(0.05));
}

TEST_CASE("segment: missing points and invalid options are errors") {
    CHECK(code_of([] { (void)reconstruct({}); }) == Errc::InvalidInput);
    const Image image = ball_image(2.0);
    CHECK(code_of([&] { (void)segment(image); }) == Errc::InvalidInput);  // tagging without points
    SegmentOptions options;
    options.evolve.theta = 2;
    CHECK(code_of([&] { (void)reconstruct(sphere_points(100), options); }) == Errc::InvalidOptions);
    options = {};
    options.start = SphereStart{};  // radius 0
    CHECK(code_of([&] { (void)segment(image, options); }) == Errc::InvalidOptions);
    options = {};
    for (const double bad : {0.0, -1.0}) {
        options.voxel_size = options.tag_distance = bad;
        CHECK(code_of([&] { (void)segment(image, sphere_points(100), options); }) == Errc::InvalidOptions);
    }
    options = {};
    options.roi = WorldBox{{0, 0, 0}, {1, 0, 1}};
    CHECK(code_of([&] { (void)segment(image, sphere_points(100), options); }) == Errc::InvalidOptions);
}

TEST_CASE("segment: points that enclose nothing, and parts too far apart, are refused for what they are") {
    const auto in_two_places = [](const std::vector<Vec3>& points, const Vec3& second) {
        std::vector<Vec3> both = points;
        for (const Vec3& p : points) both.push_back({p[0] + second[0], p[1] + second[1], p[2] + second[2]});
        return both;
    };
    std::vector<Vec3> line;
    for (int n = 0; n < 50; ++n) line.push_back({0.5 * n, 0.25 * n, 0});
    for (const auto& points : {line, in_two_places(line, {10000, 5000, 0})})
        CHECK_THROWS_WITH((void)reconstruct(points), Catch::Contains("the points lie on a line"));
    // Two balls, 15,000 radii apart.
    CHECK_THROWS_WITH((void)reconstruct(in_two_places(sphere_points(3000), {15000 * kRadius, 0, 0})),
                      Catch::Contains("parts that are far apart compared to their size: the largest part is 16 long"));
}

TEST_CASE("segment: a region of the image, and another cloud, give a surface on the same lattice") {
    const Image image = ball_image(1.0);
    SegmentOptions options;
    const SegmentResult whole = segment(image, sphere_points(300), options);
    options.roi = WorldBox{{-11.3, -10.9, -11.1}, {11.6, 11.4, 11.2}};
    const SegmentResult part = segment(image, sphere_points(300), options);
    CHECK(part.surface->transform() == whole.surface->transform());
    CHECK(mean_radius(part.mesh) == Approx(mean_radius(whole.mesh)).epsilon(1e-4));

    options = {};
    options.voxel_size = 0.7;
    const SegmentResult cloud = reconstruct(sphere_points(6000), options);
    std::vector<Vec3> turned = sphere_points(5000);  // another cloud, with a bounding box of its own
    for (Vec3& p : turned) std::swap(p[0], p[2]);
    CHECK(reconstruct(turned, options).surface->transform() == cloud.surface->transform());
    options.lattice_origin = Vec3{0.1, 0.2, 0.3};
    CHECK(reconstruct(turned, options).surface->transform().indexToWorld(openvdb::Vec3d(0, 0, 0)) ==
          openvdb::Vec3d(0.1, 0.2, 0.3));
}

TEST_CASE("segment: a set cancel flag ends the run with the error Cancelled") {
    const std::atomic<bool> cancel = true;
    RunContext run;
    run.cancel = &cancel;
    CHECK(code_of([&] { (void)reconstruct(sphere_points(1200), {}, run); }) == Errc::Cancelled);
}

TEST_CASE("Points are tagged if a tag distance, the paper's model or a start other than a guess is given") {
    SegmentOptions options;
    CHECK_FALSE(options.tags_points());
    options.start = GuessStart{};
    CHECK_FALSE(options.tags_points());
    options.tag_distance = 3;
    CHECK(options.tags_points());
    options = {};
    options.model = Model::Paper;
    CHECK(options.tags_points());
    options = {};
    options.start = SphereStart{};
    CHECK(options.tags_points());
}

TEST_CASE("choose_voxel_size: the spacing of the image, or that of distinct points scaled by their number") {
    const Image image = ball_image(2.0);
    CHECK(choose_voxel_size(image).voxel_size == 2.0);
    // The voxel size for three distinct points with a spacing of 3 is that of 4,000 points on the same surface, or of a
    // thousand points if they are tagged.
    const std::vector<Vec3> three{{0, 0, 0}, {3, 0, 0}, {0, 0, 0}, {6, 0, 0}};
    CHECK(choose_voxel_size(three).voxel_size == Approx(3 * std::sqrt(3.0 / 4000)));
    CHECK(choose_voxel_size(three, true).voxel_size == Approx(3 * std::sqrt(3.0 / 1000)));
    std::vector<Vec3> plate;
    for (int i = 0; i < 40; ++i)
        for (int j = 0; j < 25; ++j) plate.push_back({3.0 * i, 3.0 * j, 0});
    CHECK(choose_voxel_size(plate, true).voxel_size == Approx(3));
    CHECK(choose_voxel_size(plate).voxel_size == Approx(1.5));
    CHECK(code_of([] { (void)choose_voxel_size({{1, 1, 1}, {1, 1, 1}}); }) == Errc::InvalidInput);
}
