#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "covol/cloud_cleanup.h"
#include "covol/error.h"

using namespace covol;

namespace {

/// Random points of a sphere of radius 1, moved along the normal by up to `noise`.
std::vector<Vec3> sphere(std::size_t count, double noise, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-noise, noise);
    std::vector<Vec3> points;
    for (std::size_t n = 0; n < count; ++n) {
        Vec3 p{normal(random), normal(random), normal(random)};
        const double r = std::hypot(p[0], p[1], p[2]) / (1 + uniform(random));
        points.push_back({p[0] / r, p[1] / r, p[2] / r});
    }
    return points;
}

double radius(const Vec3& p) { return std::hypot(p[0], p[1], p[2]); }

double mean_error(const std::vector<Vec3>& points) {
    double sum = 0;
    for (const Vec3& p : points) sum += std::abs(radius(p) - 1);
    return sum / double(points.size());
}

CloudCleanupOptions with_outliers(double factor) {
    CloudCleanupOptions options;
    options.outlier_factor = factor;
    return options;
}

CloudCleanupOptions with_smoothing(CloudSmoothing smooth) {
    CloudCleanupOptions options;
    options.smooth = smooth;
    return options;
}

}  // namespace

TEST_CASE("Outliers far from the surface are removed, and the other points keep their order") {
    const std::vector<Vec3> good = sphere(5000, 0, 1);
    std::vector<Vec3> points = good;
    std::mt19937 random(2);
    std::uniform_real_distribution<double> uniform(2, 40);
    for (int n = 0; n < 25; ++n)
        points.insert(points.begin() + n * 70, {uniform(random), uniform(random), -uniform(random)});
    CloudCleanupReport report;
    const std::vector<Vec3> cleaned = clean_cloud(points, with_outliers(3), {}, &report);
    CHECK(cleaned == good);
    CHECK(report.given == 5025);
    CHECK(report.outliers == 25);
    CHECK(report.kept == 5000);
    CHECK(report.outlier_passes >= 2);
    CHECK(clean_cloud(good, with_outliers(3)) == good);
}

TEST_CASE("Outliers are removed also from a cloud of only 30 points") {
    const std::vector<Vec3> good = sphere(30, 0, 4);
    std::vector<Vec3> points = good;
    points.insert(points.begin() + 7, {9, 0, 0});
    points.push_back({0, -6, 5});
    CloudCleanupReport report;
    CHECK(clean_cloud(points, with_outliers(3), {}, &report) == good);
    CHECK(report.outliers == 2);
}

TEST_CASE("Simplification keeps one point in each cell") {
    std::vector<Vec3> points;
    for (int n = 0; n < 3000; ++n)
        points.push_back({0.01 * (n % 30) + 0.005, 0.01 * (n / 30 % 10) + 0.005, 0.01 * (n / 300) + 0.005});
    CloudCleanupOptions options;
    options.simplify = 0.1;
    CloudCleanupReport report;
    const std::vector<Vec3> cleaned = clean_cloud(points, options, {}, &report);
    CHECK(cleaned.size() == 3);
    CHECK(report.simplified == 2997);
}

TEST_CASE("Exact duplicates are removed, unless the option is off") {
    std::vector<Vec3> points = sphere(100, 0, 3);
    const std::vector<Vec3> once = points;
    points.insert(points.end(), once.begin(), once.begin() + 40);
    CloudCleanupReport report;
    CHECK(clean_cloud(points, {}, {}, &report) == once);
    CHECK(report.duplicates == 40);
    CloudCleanupOptions none;
    none.duplicates = false;
    CHECK(clean_cloud(points, none).size() == 140);
}

TEST_CASE("Smoothing by jets and WLOP halves the error of noisy points on a sphere") {
    const std::vector<Vec3> noisy = sphere(2000, 0.05, 4);
    const double before = mean_error(noisy);
    CHECK(before == Approx(0.025).epsilon(0.1));
    CloudCleanupReport report;
    const std::vector<Vec3> jets = clean_cloud(noisy, with_smoothing(CloudSmoothing::Jets), {}, &report);
    CHECK(jets.size() == noisy.size());
    CHECK(mean_error(jets) < 0.5 * before);
    CHECK(report.smoothed == noisy.size());
    CHECK(report.mean_shift > 0.5 * before);
    CHECK(report.max_shift < 0.15);
    const std::vector<Vec3> wlop = clean_cloud(noisy, with_smoothing(CloudSmoothing::Wlop), {}, &report);
    CHECK(wlop.size() == noisy.size() / 4);
    CHECK(report.smoothed == wlop.size());
    CHECK(mean_error(wlop) < 0.5 * before);
}

TEST_CASE("Cloud cleanup is bitwise identical for 1 and 8 threads") {
    const std::vector<Vec3> noisy = sphere(600, 0.1, 5);
    for (const CloudSmoothing smooth : {CloudSmoothing::Jets, CloudSmoothing::Wlop}) {
        CloudCleanupOptions options = with_outliers(1.5);
        options.simplify = 0.01;
        options.smooth = smooth;
        RunContext one, many;
        one.threads = 1;
        many.threads = 8;
        CHECK(clean_cloud(noisy, options, one) == clean_cloud(noisy, options, many));
    }
}

TEST_CASE("Clouds that are too small or lie on a line pass through all cleanup steps") {
    CloudCleanupOptions all = with_outliers(3);
    all.simplify = 1e-3;
    for (const CloudSmoothing smooth : {CloudSmoothing::Jets, CloudSmoothing::Wlop}) {
        all.smooth = smooth;
        CHECK(clean_cloud({}, all).empty());
        CHECK(clean_cloud({{1, 2, 3}}, all).size() == 1);
        std::vector<Vec3> line;
        for (int n = 0; n < 40; ++n) line.push_back({0.1 * n, 0, 0});
        for (const Vec3& p : clean_cloud(line, all)) CHECK(std::isfinite(p[0] + p[1] + p[2]));
    }
}

TEST_CASE("Cloud cleanup: invalid options and values are rejected, and a cancelled run ends") {
    const std::vector<Vec3> points = sphere(100, 0, 6);
    CHECK_THROWS_AS(clean_cloud(points, with_outliers(0.5)), Error);
    CloudCleanupOptions options;
    options.simplify = -1;
    CHECK_THROWS_AS(clean_cloud(points, options), Error);
    options.simplify = 0;
    options.neighbours = 2;
    CHECK(why_invalid(options) == "neighbours: expected >= 6, got 2");
    CHECK_THROWS_AS(clean_cloud({{0, 0, std::nan("")}}, with_outliers(3)), Error);
    const std::atomic<bool> cancel = true;
    RunContext run;
    run.cancel = &cancel;
    CHECK_THROWS_AS(clean_cloud(points, with_outliers(3), run), Error);
}
