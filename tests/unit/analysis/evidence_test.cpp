#include "covol/evidence.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "covol/domain.h"
#include "covol/error.h"
#include "covol/start.h"
#include "covol/surface.h"

using namespace covol;

namespace {

constexpr double kH = 0.5, kR = 8, kReach = 2;

Domain space() { return {kH, {0, 0, 0}, {-22, -22, -22}, {22, 22, 22}}; }

const FloatGridPtr& sphere() {
    static const FloatGridPtr grid = extract_surface(*start_from_sphere(space(), {0, 0, 0}, kR));
    return grid;
}

/// An image geometry with axis-parallel slices at a distance of 0.7: slice k lies at z = -10.5 + 0.7 k.
ImageGeometry slices() {
    ImageGeometry g;
    g.size = {45, 45, 31};
    g.spacing = {0.5, 0.5, 0.7};
    g.origin = {-11, -11, -10.5};
    return g;
}

/// Dense marks on the part of the sphere with z <= 0, moved outwards by `off` world units.
std::vector<Vec3> lower_half(double off = 0) {
    std::vector<Vec3> marks;
    const int count = 40000;
    const double golden = M_PI * (3 - std::sqrt(5.0));
    for (int n = 0; n < count; ++n) {
        const double z = 1 - (2 * n + 1.0) / count, r = std::sqrt(1 - z * z);
        if (z <= 0)
            marks.push_back(
                {(kR + off) * r * std::cos(golden * n), (kR + off) * r * std::sin(golden * n), (kR + off) * z});
    }
    return marks;
}

/// An edge detector g on the sphere's active voxels: 0.2 at positions for which `holds` is true, and 1 at the others.
template <typename Holds>
FloatGridPtr edges(Holds holds) {
    FloatGridPtr g = make_grid(space(), 1.0F, "edge");
    auto accessor = g->getAccessor();
    for (auto v = sphere()->cbeginValueOn(); v; ++v)
        accessor.setValue(v.getCoord(), holds(sphere()->indexToWorld(v.getCoord())) ? 0.2F : 1.0F);
    return g;
}

// The angle at the sphere's centre between two positions on the sphere that are kReach apart.
const double kAngle = 2 * std::asin(kReach / (2 * kR));

}  // namespace

TEST_CASE("A hemisphere without marks is unsupported except for the rim within reach of the marks") {
    const TriangleMesh mesh = extract_mesh(*sphere());
    const Evidence e = assess_evidence(mesh, lower_half(), slices(), {kReach, 0.25, 0});
    CHECK(e.area == Approx(4 * M_PI * kR * kR).epsilon(0.01));
    CHECK(e.unsupported_area / e.area == Approx((1 - std::sin(kAngle)) / 2).epsilon(0.01));
    CHECK(e.edge_strength.empty());
    CHECK(e.suggestions.empty());
    REQUIRE(e.distance_to_marks.size() == mesh.vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        const auto& x = mesh.vertices[v];
        const double elevation = std::atan2(x[2], std::hypot(x[0], x[1]));
        const double expected = elevation > 0 ? 2 * kR * std::sin(elevation / 2) : 0;
        // Neighbouring marks are about 0.3 voxel apart.
        CHECK(e.distance_to_marks[v] == Approx(expected).margin(0.3 * kH));
    }
}

TEST_CASE("Each slice reports area, marks and support of its own zone of the sphere") {
    const Evidence e = assess_evidence(extract_mesh(*sphere()), lower_half(0.5), slices(), {kReach, 0.25, 0});
    int last = -1;
    double area = 0;
    int marks = 0;
    for (const SliceEvidence& s : e.slices) {
        CHECK(s.slice > last);
        last = s.slice;
        area += s.area;
        marks += s.marks;
        const double z = -10.5 + 0.7 * s.slice;
        if (std::abs(z) < kR - 0.7) {
            // By Archimedes' theorem, the area of the sphere between two parallel planes depends only on their
            // distance.
            CHECK(s.area == Approx(2 * M_PI * kR * 0.7).epsilon(0.02));
        }
        if (z < -1 && s.marks > 0 && s.area > 0) {
            CHECK(s.marks_mean == Approx(0.5).margin(0.05 * kH));
            CHECK(s.marks_max == Approx(0.5).margin(0.1 * kH));
            CHECK(s.to_marks_mean == Approx(0.5).margin(0.1 * kH));
        }
        if (z > 1) {
            CHECK(s.marks == 0);
            CHECK(s.to_marks_max >= s.to_marks_mean);
        }
        if (z < 1) CHECK(s.unsupported_area == 0);
        if (z > 3) CHECK(s.unsupported_area == Approx(s.area));
    }
    CHECK(area == Approx(e.area));
    CHECK(marks == int(lower_half().size()));
}

TEST_CASE("Strong image edges support the surface that no marks reach") {
    const TriangleMesh mesh = extract_mesh(*sphere());
    const FloatGridPtr all = edges([](const openvdb::Vec3d&) { return true; });
    const Evidence supported = assess_evidence(mesh, lower_half(), *all, slices(), {kReach, 0.25, 5});
    CHECK(supported.unsupported_area == 0);
    CHECK(supported.suggestions.empty());
    for (const float s : supported.edge_strength) CHECK(s == Approx(0.8).margin(1e-5));

    const FloatGridPtr half = edges([](const openvdb::Vec3d& x) { return x[0] > 0; });
    const Evidence e = assess_evidence(mesh, lower_half(), *half, slices(), {kReach, 0.25, 1});
    CHECK(e.unsupported_area / e.area == Approx((1 - std::sin(kAngle)) / 4).epsilon(0.03));
    REQUIRE(e.suggestions.size() == 1);
    CHECK(e.suggestions[0].world[0] < 0);
}

TEST_CASE("The suggested outlines cover the largest unsupported area first and together all of it") {
    const TriangleMesh mesh = extract_mesh(*sphere());
    const Evidence e = assess_evidence(mesh, lower_half(), slices(), {kReach, 0.25, 20});
    REQUIRE(e.suggestions.size() >= 2);
    // Marks at elevation t cover (are within kReach of) the elevations from t - kAngle to t + kAngle. The given marks
    // cover everything up to kAngle, so the lowest outline that covers only bare surface is at 2 kAngle.
    const double z = kR * std::sin(2 * kAngle);
    CHECK(std::abs(-10.5 + 0.7 * e.suggestions[0].slice - z) <= 0.7);
    CHECK(e.suggestions[0].area == Approx(2 * M_PI * kR * kR * (std::sin(3 * kAngle) - std::sin(kAngle))).epsilon(0.1));
    double covered = 0, before = e.suggestions[0].area;
    for (const Suggestion& s : e.suggestions) {
        covered += s.area;
        CHECK(s.area <= before);
        before = s.area;
        CHECK(s.world[2] > 0);
        CHECK(s.index[2] == Approx(s.slice).margin(1e-3));
        CHECK(std::hypot(s.world[0], s.world[1], s.world[2]) == Approx(kR).margin(0.3 * kH));
        const Vec3 back = slices().index_to_world(s.index);
        for (int a = 0; a < 3; ++a) CHECK(back[a] == Approx(s.world[a]).margin(1e-9));
    }
    CHECK(covered == Approx(e.unsupported_area).epsilon(0.02));
    CHECK(e.suggestions.size() < 10);
}

TEST_CASE("Without marks the whole surface is unsupported, and threads do not change the suggestions") {
    const TriangleMesh mesh = extract_mesh(*sphere());
    const Evidence e = assess_evidence(mesh, {}, slices(), {kReach, 0.25, 3});
    CHECK(e.unsupported_area == e.area);
    CHECK(e.distance_to_marks.empty());
    CHECK(e.suggestions.size() == 3);
    RunContext one;
    one.threads = 1;
    const Evidence again = assess_evidence(mesh, {}, slices(), {kReach, 0.25, 3}, one);
    for (int n = 0; n < 3; ++n) {
        CHECK(again.suggestions[n].world == e.suggestions[n].world);
        CHECK(again.suggestions[n].area == e.suggestions[n].area);
    }
}

TEST_CASE("assess_evidence() rejects an empty mesh and names options that are out of range") {
    CHECK_THROWS_AS(assess_evidence({}, {}, slices(), {kReach, 0.25, 0}), Error);
    const TriangleMesh mesh = extract_mesh(*sphere());
    CHECK_THROWS_WITH(assess_evidence(mesh, {}, slices(), {0, 0.25, 0}), Catch::Contains("reach"));
    CHECK_THROWS_WITH(assess_evidence(mesh, {}, slices(), {1, 1.5, 0}), Catch::Contains("weak_edge"));
    CHECK_THROWS_WITH(assess_evidence(mesh, {}, slices(), {1, 0.5, -1}), Catch::Contains("suggestions"));
}
