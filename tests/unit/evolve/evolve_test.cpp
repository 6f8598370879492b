#include "covol/evolve.h"
#include "covol/start.h"

#include <catch2/catch.hpp>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "covol/error.h"
#include "evolve/change_kernel.h"
#include "support/both_solvers.h"
#include "support/scratch.h"
#include "support/shapes.h"

using namespace covol;
using namespace covol::test;

namespace {

constexpr double kH = 0.5;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A problem with both terms of the flow: a distance to points and an edge detector. The start is an ellipsoid beside
/// the centre, so that exchanged axes change the result. The active voxels are those near its surface, not whole
/// leaves, so that partly active leaves are tested, too.
Problem problem_with_all_terms(int n = 28, int first = -5) {
    Problem p;
    p.domain = cube_domain(n, kH, first);
    const Function surface = [](const Vec3& x) { return length({x[0] - 0.4, 1.2 * x[1], x[2] + 0.3}) - 4.0; };
    const auto points = sphere_points(150, 3.4);
    p.u = rounded(sample(p.domain, [&](const Vec3& x) { return clamp_to(surface(x), 3 * kH); }));
    p.active = active_where(p.domain, p.u, [&](const Vec3& x) { return std::abs(surface(x)) < 3.5 * kH; });
    set_distance(
        p, [&](const Vec3& x) { return distance_to(points, x); }, 0.9);
    set_edge(
        p, [](const Vec3& x) { return 1 / (1 + 4 * std::exp(-4 * std::pow(length(x) - 3.6, 2))); }, 0.7);
    p.options.delta = kH;
    p.options.tau = kH;
    return p;
}

Errc evolve_code(const std::function<void()>& call) { return code_of(call, "evolve: "); }

bool same_bits(const FloatGrid& a, const FloatGrid& b) {
    if (!a.tree().hasSameTopology(b.tree())) return false;
    auto other = b.getConstAccessor();
    for (auto v = a.cbeginValueAll(); v; ++v) {
        const float x = *v, y = other.getValue(v.getCoord());
        if (!(x == y) && !(std::isnan(x) && std::isnan(y))) return false;
    }
    return true;
}

}  // namespace

TEST_CASE("EvolveOptions: every option that is out of range is named") {
    CHECK(why_invalid(EvolveOptions{}).empty());
    const auto rejects = [](const char* field, auto EvolveOptions::*member, auto value) {
        EvolveOptions o;
        o.*member = value;
        const std::string why = why_invalid(o);
        INFO(field << " = " << value << ": " << why);
        CHECK(why.rfind(std::string(field) + ": expected ", 0) == 0);
        CHECK(why.find('\n') == std::string::npos);
        CHECK(why.find(", got ") != std::string::npos);
    };
    for (const double bad : {-0.1, 1.1, kNaN}) {
        rejects("theta", &EvolveOptions::theta, bad);
        rejects("rho", &EvolveOptions::rho, bad);
        rejects("image_yields", &EvolveOptions::image_yields, bad);
    }
    for (const double bad : {kNaN, kInfinity}) {
        rejects("delta", &EvolveOptions::delta, bad);
        rejects("tau", &EvolveOptions::tau, bad);
        rejects("attraction_range", &EvolveOptions::attraction_range, bad);
        rejects("tolerance", &EvolveOptions::tolerance, bad);
        rejects("solver_tolerance", &EvolveOptions::solver_tolerance, bad);
    }
    for (const double bad : {0.0, -1.0, kNaN, kInfinity}) {
        rejects("epsilon", &EvolveOptions::epsilon, bad);
        rejects("edge_epsilon", &EvolveOptions::edge_epsilon, bad);
    }
    for (const double bad : {0.0, -1.0}) rejects("tau", &EvolveOptions::tau, bad);
    rejects("delta", &EvolveOptions::delta, -1.0);
    rejects("attraction_range", &EvolveOptions::attraction_range, -1.0);
    rejects("tolerance", &EvolveOptions::tolerance, -1.0);
    rejects("solver_tolerance", &EvolveOptions::solver_tolerance, 0.0);
    rejects("max_steps", &EvolveOptions::max_steps, -1);
    rejects("max_sweeps", &EvolveOptions::max_sweeps, 0);

    EvolveOptions two;
    two.theta = 2;
    two.max_steps = -3;
    CHECK(why_invalid(two) == "theta: expected 0 to 1, got 2\nmax_steps: expected >= 0, got -3");
}

TEST_CASE("evolve(): invalid options and grids are rejected, and u is unchanged") {
    const Problem p = problem_with_all_terms(20);
    const Fields grids(p);
    const FloatGridPtr u = start_of(p), before = start_of(p);
    const EvolveOptions good = evolve_options(p.options, 2);
    SECTION("options") {
        EvolveOptions bad = good;
        bad.theta = -1;
        CHECK(evolve_code([&] { evolve(*u, grids.get(), bad); }) == Errc::InvalidOptions);
    }
    SECTION("no distance") {
        EvolveFields fields = grids.get();
        fields.distance = nullptr;
        CHECK(evolve_code([&] { evolve(*u, fields, good); }) == Errc::InvalidInput);
    }
    SECTION("no edge detector") {
        EvolveFields fields = grids.get();
        fields.edge = nullptr;
        CHECK(evolve_code([&] { evolve(*u, fields, good); }) == Errc::InvalidInput);
    }
    SECTION("distance with another voxel size") {
        Domain other = p.domain;
        other.voxel_size *= 1.01;
        set_domain(*grids.distance, other);
        CHECK(evolve_code([&] { evolve(*u, grids.get(), good); }) == Errc::InvalidInput);
    }
    SECTION("edge detector with another origin") {
        Domain other = p.domain;
        other.origin[1] += 0.1 * kH;
        set_domain(*grids.edge, other);
        CHECK(evolve_code([&] { evolve(*u, grids.get(), good); }) == Errc::InvalidInput);
    }
    CHECK(same_bits(*u, *before));
}

TEST_CASE("evolve(): a time step or delta whose coefficients underflow or overflow is rejected") {
    const Problem p = problem_with_all_terms(20);
    const Fields grids(p);
    const FloatGridPtr u = start_of(p), before = start_of(p);
    EvolveOptions options = evolve_options(p.options, 2);
    const auto code = [&](double tau, double delta) {
        options.tau = tau, options.delta = delta;
        return evolve_code([&] { evolve(*u, grids.get(), options); });
    };
    CHECK(code(1e-9 * kH, kH) == Errc::InvalidOptions);
    CHECK(code(1e300, kH) == Errc::InvalidOptions);
    CHECK(code(kH, 1e308) == Errc::InvalidOptions);
    CHECK(same_bits(*u, *before));
    evolve(*u, grids.get(), [&] {
        options.tau = 2e-3 * kH, options.delta = kH;
        return options;
    }());
    CHECK_FALSE(same_bits(*u, *before));
}

TEST_CASE("evolve(): an empty band is rejected") {
    const FloatGridPtr u = make_grid(cube_domain(8, kH), 1.0F, "u");
    EvolveOptions o;
    o.theta = o.rho = 0;
    CHECK(evolve_code([&] { evolve(*u, {}, o); }) == Errc::InvalidInput);
}

TEST_CASE("evolve(): an active value that is not finite is rejected, and u is unchanged") {
    const Problem p = problem_with_all_terms(20);
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()})
        for (const auto& [what, follow] :
             {std::pair("u", false), std::pair("distance", false), std::pair("edge", false), std::pair("u", true),
              std::pair("distance", true), std::pair("edge", true)}) {
            const Fields grids(p);
            const FloatGridPtr u = start_of(p);
            const openvdb::Coord at = u->cbeginValueOn().getCoord();
            (what == std::string("u")      ? u
             : what == std::string("edge") ? grids.edge
                                           : grids.distance)
                ->tree()
                .setValueOn(at, bad);
            const FloatGridPtr before = u->deepCopy();
            INFO(bad << " in " << what << (follow ? ", tracked" : ""));
            EvolveOptions options = evolve_options(p.options, 2);
            options.follow = follow;
            CHECK(evolve_code([&] { evolve(*u, grids.get(), options); }) == Errc::InvalidInput);
            CHECK(same_bits(*u, *before));
        }
}

TEST_CASE("evolve(): a frozen value that is not finite is an error, and u is unchanged") {
    const Problem p = problem_with_all_terms(20);
    const FloatGridPtr u = start_of(p);
    // The voxel that is not finite lies next to an active voxel, so that its value enters a row of the system.
    openvdb::Coord at = u->cbeginValueOn().getCoord();
    while (u->tree().isValueOn(at)) at.x() -= 1;
    u->tree().setValueOff(at, std::numeric_limits<float>::quiet_NaN());
    const FloatGridPtr before = u->deepCopy();
    const Errc code = evolve_code([&] { evolve(*u, Fields(p).get(), evolve_options(p.options, 2)); });
    CHECK((code == Errc::Numerical || code == Errc::InvalidInput));
    CHECK(same_bits(*u, *before));
}

TEST_CASE("evolve(): without steps u is unchanged") {
    const Problem p = problem_with_all_terms(20);
    const FloatGridPtr u = start_of(p);
    const EvolveReport report = evolve(*u, Fields(p).get(), evolve_options(p.options, 0));
    CHECK(report.steps == 0);
    CHECK(report.stop_reason == StopReason::MaxSteps);
    CHECK(max_difference(to_dense(p.domain, *u), p.u) == 0);
}

TEST_CASE("evolve(): u keeps its topology and its inactive values") {
    const Problem p = problem_with_all_terms();
    const FloatGridPtr before = start_of(p), u = start_of(p);
    const EvolveReport report = evolve(*u, Fields(p).get(), evolve_options(p.options, 3));
    CHECK(report.steps == 3);
    CHECK(report.active_voxels == static_cast<std::int64_t>(before->activeVoxelCount()));
    CHECK(report.leaf_count == static_cast<std::int64_t>(before->tree().leafCount()));
    CHECK(report.sweeps_per_step > 0);
    CHECK(report.leaf_visits > 0);
    REQUIRE(u->tree().hasSameTopology(before->tree()));
    auto old = before->getConstAccessor();
    for (auto v = u->cbeginValueOff(); v; ++v) REQUIRE(*v == old.getValue(v.getCoord()));
    CHECK(max_difference(to_dense(p.domain, *u), p.u) > 0.1 * kH);
}

TEST_CASE("evolve(): u is bit-identical for 1, 2 and 8 threads") {
    const Problem p = problem_with_all_terms(44);
    EvolveOptions options = evolve_options(p.options, 6);
    options.solver_tolerance = 1e-3;
    options.attraction_range = 4 * kH;
    options.image_yields = 0.5;
    for (const bool follow : {false, true}) {
        options.follow = follow;
        const FloatGridPtr one = run_evolve_grid(p, options, 1);
        CHECK(same_bits(*one, *run_evolve_grid(p, options, 2)));
        CHECK(same_bits(*one, *run_evolve_grid(p, options, 8)));
    }
}

TEST_CASE("evolve(): the evolution ends when the surface is steady, and reports this") {
    Problem p = whole_cube(20, kH, [](const Vec3& x) { return clamp_to(length(x) - 3.5, 3 * kH); });
    set_distance(p, [](const Vec3& x) { return std::abs(length(x) - 3.0); });
    EvolveOptions o = evolve_options(p.options, 100);
    o.tolerance = 1e-2;
    const FloatGridPtr u = start_of(p);
    const EvolveReport report = evolve(*u, Fields(p).get(), o);
    CHECK(report.stop_reason == StopReason::Steady);
    CHECK(report.steps < 100);
    CHECK(report.last_change < 1e-2 * p.options.tau / kH);
    REQUIRE(int(report.changes.size()) == report.steps);
    CHECK(report.changes.back() == Approx(report.last_change));
    CHECK(report.changes.back() < report.changes.front());
    const DenseField end = to_dense(p.domain, *u);
    for (const Crossing& c : zero_crossings(p.domain, end)) CHECK(length(c.position) == Approx(3.0).margin(0.5 * kH));
}

TEST_CASE("evolve(): an automatic time step grows by sqrt(2) while the surface hardly moves") {
    // In a distance field of constant slope, a plane moves by the slope times the time step in each step.
    Problem p = whole_cube(20, kH, [](const Vec3& x) { return clamp_to(x[0], 3 * kH); });
    set_distance(p, [](const Vec3& x) { return 10 - 0.02 * x[0]; });
    EvolveOptions o = evolve_options(p.options, 6);
    o.tau.reset();
    const FloatGridPtr u = start_of(p);
    const std::vector<float> changes = evolve(*u, Fields(p).get(), o).changes;
    REQUIRE(changes.size() == 6);
    for (std::size_t n = 1; n < changes.size(); ++n)
        CHECK(changes[n] / changes[n - 1] == Approx(std::sqrt(2.0)).epsilon(0.02));
}

TEST_CASE("evolve(): inactive leaves change the surface by less than 0.01 voxels") {
    // The sphere of the points touches the start on one side. This side is steady long before the opposite one arrives.
    const Vec3 target{4, 0, 0};
    Problem p = whole_cube(48, kH, [](const Vec3& x) { return clamp_to(length(x) - 9.5, 3 * kH); });
    set_distance(p, [&](const Vec3& x) { return std::abs(length({x[0] - target[0], x[1], x[2]}) - 5.5); });
    p.options.delta = 0.1 * kH;
    for (const bool follow : {false, true}) {
        INFO((follow ? "a tracked band" : "a fixed band"));
        EvolveOptions o = evolve_options(p.options, 60);
        o.follow = follow;
        o.solver_tolerance = EvolveOptions{}.solver_tolerance;
        o.tolerance = 4e-3;  // a tolerance at which some leaves become inactive
        const FloatGridPtr some_active = start_of(p), all_active = start_of(p);
        const EvolveReport some = evolve(*some_active, Fields(p).get(), o);
        o.tolerance = 0;  // no leaf ever becomes inactive
        o.max_steps = some.steps;
        const EvolveReport all = evolve(*all_active, Fields(p).get(), o);
        if (follow) CHECK(some.leaf_visits < all.leaf_visits);
        const auto here = zero_crossings(p.domain, to_dense(p.domain, *some_active));
        const auto there = zero_crossings(p.domain, to_dense(p.domain, *all_active));
        REQUIRE(here.size() > 1000);
        double worst = 0;
        for (const Crossing& c : here) {
            double nearest = 1;
            for (const Crossing& d : there)
                nearest = std::min(nearest, length({c.position[0] - d.position[0], c.position[1] - d.position[1],
                                                    c.position[2] - d.position[2]}));
            worst = std::max(worst, nearest);
        }
        CHECK(worst < 0.01 * kH);
        std::printf("inactive leaves, %s: %.0f %% of the visits, surface apart by at most %.1e h\n",
                    follow ? "tracked band" : "fixed band", 100.0 * double(some.leaf_visits) / double(all.leaf_visits),
                    worst / kH);
    }
}

TEST_CASE("evolve(): a surface that shrinks to nothing is reported as vanished") {
    Problem p = whole_cube(14, kH, [](const Vec3& x) { return clamp_to(length(x) - 1.0, 3 * kH); });
    p.options.delta = 4 * kH;
    const FloatGridPtr u = start_of(p);
    const EvolveReport report = evolve(*u, {}, evolve_options(p.options, 100));
    CHECK(report.stop_reason == StopReason::Vanished);
    CHECK(report.steps < 100);
    CHECK(zero_crossings(p.domain, to_dense(p.domain, *u)).empty());
}

TEST_CASE("evolve(): a shrinking surface stops at an obstacle") {
    constexpr double kRadius = 2.0;
    Problem p = whole_cube(20, kH, [](const Vec3& x) { return clamp_to(length(x) - 3.5, 3 * kH); });
    const FloatGridPtr obstacle = start_grid(
        p.domain, [](const Vec3& x) { return length(x) - kRadius; }, 3 * kH);
    for (const bool follow : {false, true}) {
        INFO((follow ? "a tracked band" : "a fixed band"));
        EvolveOptions o = evolve_options(p.options, 300);
        o.theta = 0;
        o.delta = kH;
        o.follow = follow;
        o.tolerance = 1e-3;
        EvolveFields fields;
        fields.obstacle = obstacle.get();
        const FloatGridPtr u = start_of(p);
        CHECK(evolve(*u, fields, o).stop_reason == StopReason::Steady);
        const auto crossings = zero_crossings(p.domain, to_dense(p.domain, *u));
        REQUIRE(crossings.size() > 100);
        for (const Crossing& c : crossings) CHECK(length(c.position) == Approx(kRadius).margin(0.1 * kH));
        // Without the obstacle the surface vanishes.
        CHECK(evolve(*start_of(p), {}, o).stop_reason == StopReason::Vanished);
    }
}

TEST_CASE("evolve(): a surface between a coinciding obstacle and floor stays in place") {
    Problem p = whole_cube(20, kH, [](const Vec3& x) { return clamp_to(length(x) - 3.5, 3 * kH); });
    const FloatGridPtr held = start_grid(
        p.domain, [](const Vec3& x) { return length(x) - 3.5; }, 3 * kH);
    for (const bool follow : {false, true}) {
        INFO((follow ? "a tracked band" : "a fixed band"));
        EvolveOptions o = evolve_options(p.options, 40);
        o.theta = 0;
        o.delta = kH;
        o.follow = follow;
        EvolveFields fields;
        fields.obstacle = fields.floor = held.get();
        const FloatGridPtr u = start_of(p);
        evolve(*u, fields, o);
        const auto crossings = zero_crossings(p.domain, to_dense(p.domain, *u));
        REQUIRE(crossings.size() > 100);
        for (const Crossing& c : crossings) CHECK(length(c.position) == Approx(3.5).margin(0.05 * kH));
    }
}

TEST_CASE("evolve(): a tracked band cut by any faces of its domain keeps the sign of the solid") {
    constexpr double kBall = 90;
    const Domain whole = make_domain({{-128, -128, -128}, {128, 128, 128}}, 1.0);
    const FloatGridPtr ball = start_from_sphere(make_domain(whole.world_box(), 2.0), {0, 0, 0}, kBall);
    for (int octant = 0; octant < 8; ++octant) {
        Domain part = whole;
        for (int a = 0; a < 3; ++a) octant >> a & 1 ? part.min[a] = 112 : part.max[a] = 143;
        const FloatGridPtr u = start_from_grid(part, *ball);
        EvolveOptions o;
        o.theta = o.rho = 0;
        o.delta = 1;
        o.follow = true;
        o.max_steps = 12;
        evolve(*u, {}, o);
        int wrong = 0;
        for (int i = part.min[0]; i <= part.max[0]; i += 3)
            for (int j = part.min[1]; j <= part.max[1]; j += 3)
                for (int k = part.min[2]; k <= part.max[2]; k += 3) {
                    const double d = length(part.index_to_world({double(i), double(j), double(k)})) - kBall;
                    wrong += std::abs(d) > 4 && (u->tree().getValue({i, j, k}) < 0) != (d < 0);
                }
        CHECK(wrong == 0);
    }
}

TEST_CASE("evolve(): after cancellation u is the result of the last complete step") {
    const Problem p = problem_with_all_terms(20);
    std::atomic<bool> cancel{false};
    RunContext run;
    run.cancel = &cancel;
    int reports = 0;
    run.progress = [&](const std::string&, double fraction) {
        CHECK(fraction >= 0);
        CHECK(fraction <= 1);
        if (++reports == 3) cancel = true;
    };
    const FloatGridPtr u = start_of(p);
    const EvolveReport report = evolve(*u, Fields(p).get(), evolve_options(p.options, 50), run);
    CHECK(report.stop_reason == StopReason::Cancelled);
    REQUIRE(report.steps == 3);
    CHECK(max_difference(to_dense(p.domain, *u), run_evolve(p, 3)) == 0);
}

TEST_CASE("Neumann condition: a plane perpendicular to the boundary stays a plane") {
    for (int axis = 0; axis < 3; ++axis) {
        // A domain of 13 voxels along each axis ends inside leaves.
        Problem p = whole_cube(
            13, kH, [&](const Vec3& x) { return clamp_to(x[axis] - 0.3, 3 * kH); }, 3);
        set_distance(p, [&](const Vec3& x) { return std::abs(x[axis] - 1.1); });
        p.options.delta = kH;
        const DenseField u = run_evolve(p, 4);
        CHECK(max_difference(u, run_dense(p, 4)) < 1e-4 * kH);
        double bent = 0;
        for_each_voxel(p.domain, [&](int i, int j, int k, const Vec3&) {
            Index3 on_axis{0, 0, 0};
            on_axis[axis] = Index3{i, j, k}[axis];
            bent = std::max(bent, std::abs(u.at(i, j, k) - u.at(on_axis[0], on_axis[1], on_axis[2])));
        });
        CHECK(bent < 1e-4 * kH);  // coefficients are rounded to 16 bits
    }
}

TEST_CASE("Neumann condition: a domain together with its mirror image gives the same values") {
    const Function waves = random_waves(21, 4.0), slopes = random_waves(22, 5.0);
    for (int axis = 0; axis < 3; ++axis) {
        const int n = 11;
        Problem p = whole_cube(
            n, kH, [&](const Vec3& x) { return clamp_to(2 * waves(x), 3 * kH); }, -4);
        set_distance(p, [](const Vec3& x) { return distance(x, {0.9, -2.0, 1.5}); });
        set_edge(p, [&](const Vec3& x) { return 0.5 + 0.2 * slopes(x); });
        p.options.delta = kH;

        const auto doubled = [&](const DenseField& field) {
            Index3 size{n, n, n};
            size[axis] *= 2;
            DenseField result(size[0], size[1], size[2], kH);
            for (int i = 0; i < size[0]; ++i)
                for (int j = 0; j < size[1]; ++j)
                    for (int k = 0; k < size[2]; ++k) {
                        Index3 from{i, j, k};
                        if (from[axis] >= n) from[axis] = 2 * n - 1 - from[axis];
                        result.at(i, j, k) = field.at(from[0], from[1], from[2]);
                    }
            result.mirror_ghosts();
            return result;
        };
        Problem twice = p;
        twice.domain.max[axis] += n;
        twice.u = doubled(p.u);
        twice.active = all_active(twice.u);
        twice.distance = doubled(p.distance);
        twice.edge = doubled(p.edge);
        CHECK(max_difference(doubled(run_dense(p, 3)), run_dense(twice, 3)) < 1e-8);
        CHECK(max_difference(doubled(run_evolve(p, 3)), run_evolve(twice, 3)) < 1e-4 * kH);
    }
}

TEST_CASE("Attraction range: points farther away do not move the surface") {
    Problem p = whole_cube(16, kH, [](const Vec3& x) { return clamp_to(x[0], 3 * kH); });
    set_distance(p, [](const Vec3& x) { return 10 - x[0]; });
    p.options.attraction_range = 4.0;
    CHECK(max_difference(run_evolve(p, 3), p.u) < 1e-6);
    p.options.attraction_range = 0;
    CHECK(max_difference(run_evolve(p, 3), p.u) > kH);
}

TEST_CASE("image_yields: where the distance is unknown, the image keeps its full weight") {
    Problem p = whole_cube(16, kH, [](const Vec3& x) { return clamp_to(x[1], 3 * kH); });
    p.distance = sample(p.domain, [](const Vec3& x) { return x[0] > 0 ? NAN : 0.1; });
    set_edge(p, [](const Vec3& x) { return 0.5 + 0.05 * x[1]; });
    p.options.attraction_range = 2.0;
    p.options.image_yields = 1.0;
    const DenseField u = run_evolve(p, 2);
    CHECK(max_difference(u, run_dense(p, 2)) < 1e-4 * kH);
    CHECK(u.at(2, 8, 8) == Approx(p.u.at(2, 8, 8)).margin(1e-5));
    CHECK(u.at(12, 8, 8) > p.u.at(12, 8, 8) + kH);
}

TEST_CASE("change_of: the maximum change in a leaf, and any value that is not finite is detected") {
    std::vector<float> before(512), now(512);
    for (std::size_t n = 0; n < 512; ++n) now[n] = before[n] = float(n) - 200.0F;
    now[301] -= 3.5F;
    now[17] += 2.0F;
    detail::Change change = detail::change_of(now.data(), before.data());
    CHECK(change.largest == 3.5F);
    CHECK(change.finite);
    CHECK(detail::all_finite(now.data()));
    for (const float wrong : {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
                              std::numeric_limits<float>::quiet_NaN()})
        for (const std::size_t at : {0, 7, 100, 511}) {
            std::vector<float> broken = now;
            broken[at] = wrong;
            CHECK_FALSE(detail::change_of(broken.data(), before.data()).finite);
            CHECK_FALSE(detail::all_finite(broken.data()));
        }
}
