#include "covol/bricks.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "bricks/split.h"
#include "covol/error.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "support/shapes.h"

using namespace covol;

namespace {

constexpr double kRadius = 40.0;
constexpr int kSide = 112;

std::vector<Vec3> marks_on_ball(int count) { return test::sphere_points(count, kRadius); }

Image ball_image() {
    ImageGeometry geometry;
    geometry.size = {kSide, kSide, kSide};
    geometry.origin = {-0.5 * (kSide - 1), -0.5 * (kSide - 1), -0.5 * (kSide - 1)};
    std::vector<float> values;
    for (int k = 0; k < kSide; ++k)
        for (int j = 0; j < kSide; ++j)
            for (int i = 0; i < kSide; ++i) {
                const Vec3 w = geometry.index_to_world({double(i), double(j), double(k)});
                values.push_back(float(std::clamp(kRadius - std::hypot(w[0], w[1], w[2]) + 0.5, 0.0, 1.0)));
            }
    return Image::from_values(geometry, values.data());
}

/// Solves the bricks in sweeps until all seams are within the tolerance. In each sweep, a brick's neighbours have the
/// states of the previous sweep. @return number of sweeps
int solve_all(const BrickJob& job, const BrickPlan& plan, std::vector<FloatGridPtr>& states) {
    states.assign(plan.bricks.size(), nullptr);
    for (int sweep = 1;; ++sweep) {
        REQUIRE(sweep <= plan.options.max_sweeps);
        const std::vector<FloatGridPtr> before = states;
        const BrickStates known = [&](std::size_t n) { return before[n]; };
        bool moved = false;
        for (std::size_t n = 0; n < states.size(); ++n) {
            if (sweep > 1 && (!plan.has_sweeps || measure_seams(plan, n, known) < plan.options.tolerance)) continue;
            states[n] = job.solve(plan, n, known).state;
            moved = true;
        }
        if (!moved) return sweep - 1;
    }
}

/// The maximum difference of two level sets, in voxels, at the voxels within one voxel of the first one's surface, and
/// the number of these voxels.
struct StateDifference {
    double maximum = 0;
    std::int64_t count = 0;
};
StateDifference difference_of(const FloatGrid& a, const FloatGrid& b) {
    StateDifference result;
    const double h = a.voxelSize()[0];
    const auto at = b.getConstAccessor();
    for (auto value = a.cbeginValueOn(); value; ++value) {
        if (std::abs(*value) > h) continue;
        result.maximum = std::max(result.maximum, std::abs(*value - double(at.getValue(value.getCoord()))) / h);
        ++result.count;
    }
    return result;
}

bool overlap(const VoxelBox& a, const VoxelBox& b) {
    for (int axis = 0; axis < 3; ++axis)
        if (a.min[axis] > b.max[axis] || b.min[axis] > a.max[axis]) return false;
    return true;
}

}  // namespace

TEST_CASE("Bricks of whole leaves partition the domain, each with at most the given number of active voxels") {
    const Domain fine = make_domain({{-60, -50, -40}, {70, 61, 53}}, 0.5);
    const Domain coarse = make_domain({{-60, -50, -40}, {70, 61, 53}}, 2.0);
    const FloatGridPtr ball = start_from_sphere(coarse, {3, 4, 5}, 30);
    BrickOptions options;
    options.max_voxels = 40000;
    const std::vector<Brick> bricks = bricks::split(fine, *ball, options);
    REQUIRE(bricks.size() > 8);
    std::int64_t voxels = 0, band = 0;
    for (std::size_t n = 0; n < bricks.size(); ++n) {
        const Brick& brick = bricks[n];
        const Index3 size = brick.core.size();
        voxels += std::int64_t(size[0]) * size[1] * size[2];
        band += brick.active_voxels;
        CHECK(brick.active_voxels <= options.max_voxels);
        CHECK(brick.active_voxels > options.max_voxels / 8);
        for (int a = 0; a < 3; ++a) {
            CHECK((brick.core.min[a] == fine.min[a] || brick.core.min[a] % 8 == 0));
            CHECK((brick.core.max[a] == fine.max[a] || (brick.core.max[a] + 1) % 8 == 0));
        }
        for (std::size_t m = 0; m < n; ++m) CHECK_FALSE(overlap(brick.core, bricks[m].core));
        for (const std::size_t m : brick.neighbours) {
            const std::vector<std::size_t>& back = bricks[m].neighbours;
            CHECK(std::find(back.begin(), back.end(), n) != back.end());
        }
    }
    CHECK(voxels == fine.voxel_count());
    CHECK(band == 16 * std::int64_t(ball->activeVoxelCount()));
}

TEST_CASE("A ball solved in bricks is within 0.05 voxels of the one in one piece, and as accurate at seams") {
    const Image image = ball_image();
    const std::vector<Vec3> points = marks_on_ball(6000);
    SegmentOptions options;
    options.model = Model::Paper;
    // From the tagged start the steady surface is up to 0.06 voxels away from the one that is computed from a coarse
    // level, as in the bricks.
    SegmentOptions from_coarse = options;
    from_coarse.coarse_levels = 1;
    const SegmentResult whole = segment(image, points, from_coarse);
    BrickJob job(image, points, options, {});
    BrickOptions bricks;
    bricks.max_voxels = 30000;
    const BrickPlan plan = job.plan(bricks);
    REQUIRE(plan.bricks.size() >= 4);
    std::vector<FloatGridPtr> states;
    const int sweeps = solve_all(job, plan, states);
    CHECK(sweeps >= 1);
    const SegmentResult joined = job.join(plan, [&](std::size_t n) { return states[n]; });
    CHECK(joined.report.surface.closed);
    CHECK(joined.report.surface.components == 1);
    CHECK(joined.report.surface.genus == 0);
    CHECK(joined.surface->transform() == whole.surface->transform());
    const StateDifference difference = difference_of(*joined.surface, *whole.surface);
    CHECK(difference.count > 20000);
    CHECK(difference.maximum < 0.05);
    // Maximum errors against the true ball: within 2 voxels of the bricks' common faces (`on`), and elsewhere (`off`).
    double on = 0, off = 0;
    for (auto value = joined.surface->cbeginValueOn(); value; ++value) {
        if (std::abs(*value) > 1) continue;
        const openvdb::Coord at = value.getCoord();
        const openvdb::Vec3d w = joined.surface->indexToWorld(at);
        const double error = std::abs(*value - (w.length() - kRadius));
        bool near = false;
        for (const Brick& brick : plan.bricks)
            for (int a = 0; a < 3; ++a)
                near = near || (brick.core.min[a] != plan.domain.min[a] && std::abs(at[a] - brick.core.min[a]) <= 2);
        double& maximum = near ? on : off;
        maximum = std::max(maximum, error);
    }
    CHECK(on < 1.1 * off);
}

TEST_CASE("Bricks joined without a mesh have the same surface and measures") {
    const Image image = ball_image();
    const std::vector<Vec3> points = marks_on_ball(6000);
    SegmentOptions options;
    options.model = Model::Paper;
    options.without_fields = true;
    const BrickJob one(image, points, options, {});
    BrickOptions bricks;
    bricks.max_voxels = 30000;
    const BrickPlan plan = one.plan(bricks);
    std::vector<FloatGridPtr> states;
    solve_all(one, plan, states);
    const BrickStates known = [&](std::size_t n) { return states[n]; };
    BrickJob with(image, points, options, {}), without(image, points, options, {});
    const SegmentResult mesh = with.join(plan, known), lean = without.join(plan, known, true);
    CHECK(lean.mesh.triangles.empty());
    CHECK(lean.u == nullptr);
    // The surfaces differ only by rounding errors, because each brick has its own origin.
    CHECK(difference_of(*mesh.surface, *lean.surface).maximum < 1e-5);
    CHECK(lean.report.surface.genus == 0);
    CHECK(lean.report.surface.volume == Approx(mesh.report.surface.volume).epsilon(1e-4));
    CHECK(lean.report.fit.mean == Approx(mesh.report.fit.mean).margin(0.01));
    CHECK(lean.report.mesh.triangles == std::int64_t(extract_mesh(*lean.surface).triangles.size()));
}

TEST_CASE("A brick without neighbours' states is solved reproducibly, and joining without states is an error") {
    const Image image = ball_image();
    const std::vector<Vec3> points = marks_on_ball(6000);
    SegmentOptions options;
    options.model = Model::Paper;
    BrickJob job(image, points, options, {});
    BrickOptions bricks;
    bricks.max_voxels = 30000;
    const BrickPlan plan = job.plan(bricks);
    const BrickStates none = [](std::size_t) { return FloatGridPtr(); };
    const SolvedBrick once = job.solve(plan, 1, none), again = job.solve(plan, 1, none);
    CHECK(once.stop_reason == StopReason::Steady);
    CHECK(once.steps > 0);
    CHECK(difference_of(*once.state, *again.state).maximum == 0);
    CHECK(measure_seams(plan, 1, none) > 1);  // kHalfWidthVoxels, because no brick has a state here
    CHECK_THROWS_AS(job.join(plan, none), Error);
}

TEST_CASE("A cloud reconstructed in bricks equals the one in one piece exactly") {
    std::vector<Vec3> points = marks_on_ball(20000);
    for (std::size_t n = 0; n < points.size(); ++n)
        for (double& x : points[n]) x *= 1 + 0.004 * std::sin(12.9898 * double(n));
    const SegmentOptions options;
    const SegmentResult whole = reconstruct(points, options);
    BrickJob job(points, options, {});
    BrickOptions bricks;
    bricks.max_voxels = 30000;
    const BrickPlan plan = job.plan(bricks);
    REQUIRE(plan.bricks.size() >= 4);
    CHECK_FALSE(plan.has_sweeps);
    std::vector<FloatGridPtr> states;
    CHECK(solve_all(job, plan, states) == 1);
    const SegmentResult joined = job.join(plan, [&](std::size_t n) { return states[n]; });
    CHECK(difference_of(*joined.surface, *whole.surface).maximum == 0);
    CHECK(joined.mesh.triangles.size() == whole.mesh.triangles.size());
    CHECK(joined.report.surface.volume == whole.report.surface.volume);
}

TEST_CASE("BrickJob: the default model, which infers from all marks together, is rejected") {
    CHECK_THROWS_AS(BrickJob(ball_image(), marks_on_ball(200), {}, {}), Error);
}

TEST_CASE("Bricks: a mark far from all others causes a warning") {
    const Image image = ball_image();
    std::vector<Vec3> points = marks_on_ball(3000);
    points.push_back({50, 50, 50});
    SegmentOptions options;
    options.model = Model::Paper;
    options.without_mesh = true;
    BrickJob job(image, points, options, {});
    BrickOptions bricks;
    bricks.max_voxels = 60000;
    const BrickPlan plan = job.plan(bricks);
    std::vector<FloatGridPtr> states;
    solve_all(job, plan, states);
    const std::vector<std::string> warnings = job.join(plan, [&](std::size_t n) { return states[n]; }).report.warnings;
    CHECK(std::any_of(warnings.begin(), warnings.end(), [](const std::string& warning) {
        return warning.starts_with("1 of 3001 marks lie far from all others");
    }));
}
