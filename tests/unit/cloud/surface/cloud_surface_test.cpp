#include "covol/cloud_surface.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>

#include "covol/error.h"
#include "covol/surface.h"
#include "support/clouds.h"
#include "support/surface_samples.h"

using namespace covol;

namespace {

struct Result {
    FloatGridPtr grid;
    CloudReport report;
    TriangleMesh mesh;
};

Result surface_of(const std::vector<Vec3>& points, double h, const RunContext& run = {}) {
    const CloudOrientation cloud = orient_cloud(points, run);
    const CloudSurface made = surface_from_cloud(make_domain(bounding_box(points, 8 * h), h), cloud, run);
    return {made.u, made.report, extract_mesh(*made.u)};
}

/// Root mean square distance of the mesh's vertices to the shape.
double rms_distance(const TriangleMesh& mesh, const test::Solid3& shape) {
    double squares = 0;
    for (const auto& v : mesh.vertices) squares += std::pow(shape.distance({v[0], v[1], v[2]}), 2);
    return std::sqrt(squares / double(mesh.vertices.size()));
}

struct Shape {
    const char* name;
    test::Solid3 solid;
    double volume;
    int genus;
};

/// The domain around the ball of radius 1.
const Domain kDomain = make_domain({{-1.5, -1.5, -1.5}, {1.5, 1.5, 1.5}}, 0.06);

}  // namespace

TEST_CASE("surface_from_cloud: closed, with the right genus and volume, closer to the shape than noisy points") {
    for (const Shape& shape : {Shape{"ball", test::ball(1), 4.0 / 3 * M_PI, 0},
                               Shape{"torus", test::torus(1, 0.35), 2 * M_PI * M_PI * 0.35 * 0.35, 1}})
        for (const auto& [spacings, seed] : std::vector<std::pair<double, unsigned>>{{0, 1}, {0.3, 2}, {0.3, 3}}) {
            test::SurfaceSample s = shape.solid.sample(4000, seed);
            const double spacing = s.spacing();
            test::add_noise(s, spacings * spacing, seed + 50);
            const Result r = surface_of(s.points, 0.7 * spacing);
            const MeshMeasures m = measure(r.mesh);
            INFO(shape.name << ", noise of " << spacings << " spacings, seed " << seed << ": off "
                            << rms_distance(r.mesh, shape.solid) / spacing << " spacings, volume "
                            << m.volume / shape.volume << " of the shape's");
            CHECK(m.closed);
            CHECK(m.manifold);
            CHECK(m.components == 1);
            CHECK(m.genus == shape.genus);
            CHECK(m.volume / shape.volume == Approx(1).margin(0.008));
            CHECK(rms_distance(r.mesh, shape.solid) < (spacings > 0 ? 0.14 : 0.015) * spacing);
            CHECK(r.report.spacing / spacing == Approx(1).margin(0.15));
            CHECK(r.report.radius > (spacings > 0 ? 4 : 2) * spacing);
            CHECK(r.report.bare_nodes < 40);
            CHECK(r.report.stray == 0);
            CHECK(r.report.dropped_pieces == 0);
        }
}

TEST_CASE("surface_from_cloud: a cavity stays a cavity, and thin legs stay connected") {
    const test::Solid3 shell = test::shell(1, 0.5), table = test::table(0.08);
    const test::SurfaceSample on_shell = shell.sample(4000, 4), on_table = table.sample(4000, 4);
    const Result hollow = surface_of(on_shell.points, 0.7 * on_shell.spacing()),
                 legs = surface_of(on_table.points, 0.7 * on_table.spacing());
    const MeshMeasures of_hollow = measure(hollow.mesh), of_legs = measure(legs.mesh);
    CHECK(of_hollow.closed);
    CHECK(of_hollow.components == 2);
    CHECK(of_hollow.genus == 0);
    CHECK(of_hollow.volume == Approx(4.0 / 3 * M_PI * (1 - 0.125)).epsilon(0.005));
    CHECK(rms_distance(hollow.mesh, shell) < 0.03 * on_shell.spacing());
    CHECK(of_legs.closed);
    CHECK(of_legs.components == 1);
    CHECK(of_legs.genus == 0);
    CHECK(rms_distance(legs.mesh, table) < 0.07 * on_table.spacing());
}

TEST_CASE("surface_from_cloud: holes in the points are closed") {
    const test::Solid3 ball = test::ball(1);
    const test::SurfaceSample s = ball.sample(4000, 5);
    std::vector<Vec3> points;
    for (const Vec3& p : s.points)
        if (p[2] < 0.9) points.push_back(p);  // without a cap of height 0.1
    const Result r = surface_of(points, 0.7 * s.spacing());
    const MeshMeasures m = measure(r.mesh);
    CHECK(m.closed);
    CHECK(m.genus == 0);
    CHECK(m.components == 1);
    CHECK(m.volume == Approx(4.0 / 3 * M_PI).epsilon(0.03));
    CHECK(measure_fit(points, r.mesh).mean < 0.05 * s.spacing());
}

TEST_CASE("surface_from_cloud: the level set is bit-identical on any number of threads") {
    test::SurfaceSample s = test::torus(1, 0.35).sample(2000, 6);
    test::add_noise(s, 0.3 * s.spacing(), 7);
    RunContext one, two;
    one.threads = 1;
    two.threads = 2;
    const Result a = surface_of(s.points, 0.8 * s.spacing(), one), b = surface_of(s.points, 0.8 * s.spacing(), two);
    CHECK(test::identical(*a.grid, *b.grid));
    CHECK(a.report.noise == b.report.noise);
    CHECK(a.report.bare_nodes == b.report.bare_nodes);
}

TEST_CASE("surface_from_cloud: a domain without the surface is rejected, and a run can be cancelled") {
    const CloudOrientation cloud = orient_cloud(test::ball(1).sample(1000, 8).points);
    CHECK_NOTHROW(surface_from_cloud(kDomain, cloud));
    Domain elsewhere = kDomain;
    elsewhere.origin[0] += 100;
    try {
        static_cast<void>(surface_from_cloud(elsewhere, cloud));
        FAIL("expected an error");
    } catch (const Error& error) {
        CHECK(error.code() == Errc::InvalidInput);
    }
    const std::atomic<bool> stop{true};
    RunContext run;
    run.cancel = &stop;
    try {
        static_cast<void>(surface_from_cloud(kDomain, cloud, run));
        FAIL("expected an error");
    } catch (const Error& error) {
        CHECK(error.code() == Errc::Cancelled);
    }
}
