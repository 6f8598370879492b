#include "cloud/indicator/consistency.h"

#include <catch2/catch.hpp>
#include <numeric>

#include "cloud/indicator/areas.h"
#include "support/surface_samples.h"

using namespace covol;

namespace {

double mean(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

/// The normals of the sample, reversed at the points for which `is_reversed` is true.
template <typename Predicate>
std::vector<Vec3> turned(const test::SurfaceSample& s, Predicate is_reversed) {
    std::vector<Vec3> normals = s.normals;
    for (std::size_t n = 0; n < normals.size(); ++n)
        if (is_reversed(s.points[n])) normals[n] = test::scaled(-1, normals[n]);
    return normals;
}

struct Case {
    explicit Case(const test::Solid3& shape, double noise = 0)
        : sample([&] {
              test::SurfaceSample s = shape.sample(6000, 1);
              test::add_noise(s, noise * s.spacing(), 2);
              return s;
          }()),
          consistency(sample.points, cloud::areas_of(sample.points, sample.spacing()), 0.55 * sample.spacing(),
                      1.5 * sample.spacing(), run) {}
    test::SurfaceSample sample;
    RunContext run;
    cloud::Consistency consistency;
};

}  // namespace

TEST_CASE("Consistency: correct normals deviate less than normals of which a part or all are reversed") {
    for (const double noise : {0.0, 0.4}) {
        const auto check_truth_is_better = [&](const test::Solid3& shape, auto is_reversed) {
            Case c(shape, noise);
            std::vector<Vec3> normals = c.sample.normals, others = turned(c.sample, is_reversed);
            const double right = mean(c.consistency.off(normals)), wrong = mean(c.consistency.off(others));
            INFO("right " << right << ", wrong " << wrong << ", noise " << noise);
            CHECK(right < 0.8 * wrong);
        };
        // Normals are reversed on one part of a torus, on the wall of a cavity, on one face of a plate so that both
        // faces point to the same side, on some legs of a table, and on a whole ball.
        check_truth_is_better(test::torus(1, 0.35), [](const Vec3& p) { return p[0] > 0.5; });
        check_truth_is_better(test::shell(1, 0.6), [](const Vec3& p) { return test::norm(p) < 0.8; });
        check_truth_is_better(test::block({0.8, 0.5, 0.06}), [](const Vec3& p) { return p[2] > 0; });
        check_truth_is_better(test::table(0.06), [](const Vec3& p) { return p[2] < -0.4 && p[0] > 0; });
        check_truth_is_better(test::ball(1), [](const Vec3& p) { return test::norm(p) > 0; });
    }
}

TEST_CASE("Consistency: take_better() adopts correct patches of another orientation and keeps its own") {
    Case c(test::torus(1, 0.35), 0.3);
    std::vector<Vec3> own = turned(c.sample, [](const Vec3& p) { return p[0] > 0.6 || p[1] < -0.9; });
    const std::vector<Vec3> other = turned(c.sample, [](const Vec3& p) { return p[0] < -0.6 || p[1] < -0.9; });
    std::vector<double> off = c.consistency.off(own);
    const double before = mean(off);
    c.consistency.take_better(other, own, off);
    CHECK(mean(off) < before);
    std::size_t right = 0, part = 0;
    for (std::size_t n = 0; n < own.size(); ++n) {
        const Vec3& p = c.sample.points[n];
        if (p[1] < -0.7) continue;  // both orientations are wrong where y < -0.9; the rest is a margin
        ++part;
        right += test::dot(own[n], c.sample.normals[n]) > 0;
    }
    CHECK(double(right) > 0.97 * double(part));
    // take_better() leaves correct normals as they are, and changes nothing if it compares an orientation with itself.
    std::vector<Vec3> best = c.sample.normals;
    std::vector<double> best_off = c.consistency.off(best);
    c.consistency.take_better(other, best, best_off);
    for (std::size_t n = 0; n < best.size(); ++n) REQUIRE(test::dot(best[n], c.sample.normals[n]) > 0);
    const std::vector<Vec3> same = own;
    c.consistency.take_better(own, own, off);
    CHECK(own == same);
}

TEST_CASE("Consistency: each point's deviation is between 0 and 1/4, and the same for any number of threads") {
    const Case c(test::ball(1));
    const std::vector<double> areas = cloud::areas_of(c.sample.points, c.sample.spacing());
    std::vector<std::vector<double>> found;
    for (const int threads : {1, 2, 8}) {
        RunContext run;
        run.threads = threads;
        with_threads(run, [&] {
            cloud::Consistency consistency(c.sample.points, areas, 0.6 * c.sample.spacing(), 0.1, run);
            std::vector<Vec3> normals = c.sample.normals;
            found.push_back(consistency.off(normals));
        });
    }
    for (const double off : found[0]) REQUIRE((off >= 0 && off <= 0.25));
    CHECK(found[1] == found[0]);
    CHECK(found[2] == found[0]);
}
