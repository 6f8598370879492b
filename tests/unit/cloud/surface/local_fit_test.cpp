#include "cloud/surface/local_fit.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "cloud/surface/fit_kernel.h"
#include "points/point_cells.h"
#include "support/clouds.h"
#include "support/surface_samples.h"

using namespace covol;
using namespace covol::cloud;

namespace {

OrientedCloud oriented(const test::SurfaceSample& s) {
    return {s.points, s.normals, std::vector<float>(s.points.size(), 1.0F), {}};
}

/// Every step-th point of a cloud.
OrientedCloud every(const OrientedCloud& cloud, std::size_t step) {
    OrientedCloud some;
    for (std::size_t n = 0; n < cloud.size(); n += step) {
        some.points.push_back(cloud.points[n]);
        some.normals.push_back(cloud.normals[n]);
        some.counts.push_back(1);
    }
    return some;
}

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
}

/// How well quadrics fit a shape if they are computed from sample points of the shape that are moved by noise. The foot
/// of a quadric is its point above or below its origin.
struct FitErrors {
    double fraction = 0;                          // fraction of the nodes that have a quadric
    double off = 0;                               // root mean square distance of the quadrics' feet from the shape
    double noise = 0, radius = 0, curvature = 0;  // medians over the quadrics
    double off_beside = 0;  // root mean square error of distance() one spacing beside and above the foot
};

FitErrors fit_shape(const test::Solid3& shape, std::size_t count, double spacings, unsigned seed) {
    test::SurfaceSample s = shape.sample(count, seed);
    const double spacing = s.spacing();
    test::add_noise(s, spacings * spacing, seed + 100);
    const OrientedCloud cloud = oriented(s);
    FitErrors found;
    std::vector<double> noise, radius, curvature;
    double squares = 0, beside = 0;
    for (const Quadric& q : fit_quadrics(every(cloud, 10), cloud, spacing, {})) {
        if (!(q.radius > 0)) continue;
        noise.push_back(q.noise);
        radius.push_back(q.radius);
        curvature.push_back(q.curvature());
        squares += std::pow(shape.distance(q.foot()), 2);
        const Vec3 x =
            test::sum(test::sum(q.foot(), test::scaled(spacing, q.axes[0])), test::scaled(spacing, q.axes[2]));
        beside += std::pow(q.distance(x) - shape.distance(x), 2);
    }
    const double fitted = double(radius.size());
    found.fraction = fitted / (double(count) / 10);
    found.off = std::sqrt(squares / fitted);
    found.off_beside = std::sqrt(beside / fitted);
    found.noise = median(noise);
    found.radius = median(radius);
    found.curvature = median(curvature);
    return found;
}

}  // namespace

TEST_CASE("fit_quadrics: the rms distance of the feet from the surface is less than half of the noise") {
    for (const unsigned seed : {1, 2, 3})
        for (const bool is_ball : {true, false}) {
            const test::Solid3 shape = is_ball ? test::ball(1) : test::torus(1, 0.35);
            const double area = is_ball ? 4 * M_PI : 4 * M_PI * M_PI * 0.35, spacing = std::sqrt(area / 8000);
            const double curvature = is_ball ? 1 : 1 / 0.35;
            double radius = 0;
            for (const double spacings : {0.0, 0.1, 0.3, 0.6}) {
                const FitErrors f = fit_shape(shape, 8000, spacings, seed);
                INFO((is_ball ? "ball" : "torus")
                     << ", seed " << seed << ", noise of " << spacings << " spacings: off " << f.off / spacing
                     << " spacings, beside " << f.off_beside / spacing << ", radius " << f.radius / spacing
                     << ", curvature " << f.curvature / curvature);
                CHECK(f.fraction > 0.99);
                const double maximum = spacings > 0 ? 0.5 * spacings : 0.001;
                CHECK(f.off < maximum * spacing);
                CHECK(f.off_beside < (spacings > 0 ? 0.6 * spacings : 0.003) * spacing);
                CHECK(f.curvature / curvature == Approx(1).margin(spacings > 0 ? 0.4 : 0.02));
                // The neighbourhoods are as wide as the noise requires.
                if (spacings > 0) CHECK(f.radius > 2.5 * spacing);
                if (spacings == 0)
                    radius = f.radius;
                else if (spacings == 0.3)
                    CHECK(f.radius > 2 * radius);
                if (spacings == 0) CHECK(f.noise < 0.01 * spacing);
            }
        }
}

TEST_CASE("A quadric's distance, foot and curvature are those of its paraboloid") {
    Quadric q;
    q.origin = {1, 2, 3};
    q.axes = {Vec3{0, 1, 0}, Vec3{0, 0, 1}, Vec3{1, 0, 0}};  // the normal is x
    q.c = {0.5, 0, 0, 2, 0, -1};                             // x - 1 = 0.5 + 2 u^2 - v^2, u = y - 2, v = z - 3
    CHECK(q.foot() == Vec3{1.5, 2, 3});
    CHECK(q.distance({1.5, 2, 3}) == Approx(0).margin(1e-15));
    CHECK(q.distance({1.7, 2, 3}) == Approx(0.2));
    CHECK(q.distance({1.4, 2, 3}) == Approx(-0.1));
    const double u = 0.3, v = -0.2, height = 0.5 + 2 * u * u - v * v;
    CHECK(q.distance({1 + height, 2 + u, 3 + v}) == Approx(0).margin(1e-15));
    const Vec3 normal = test::unit({1, -4 * u, 2 * v});
    const Vec3 above = test::sum({1 + height, 2 + u, 3 + v}, test::scaled(1e-4, normal));
    CHECK(q.distance(above) == Approx(1e-4).epsilon(0.01));
    CHECK(q.curvature() == Approx(4));
    q.c = {0, 0, 0, 1, 2, 1};  // (u + v)^2: curvature 4 along the diagonal, none across
    CHECK(q.curvature() == Approx(4));
}

TEST_CASE("fit_quadrics: an exact paraboloid is recovered") {
    // A paraboloid with the heights 0.3 u^2 - 0.2 uv + 0.1 v^2 over the plane z = 0. The nodes have its normals, so
    // that their own planes are tilted against z = 0.
    const auto height = [](double x, double y) { return 0.3 * x * x - 0.2 * x * y + 0.1 * y * y; };
    OrientedCloud cloud;
    for (Vec3 p : test::box_cloud(3000, {{-1, -1, 0}, {1, 1, 1}}, 4)) {
        p[2] = height(p[0], p[1]);
        cloud.points.push_back(p);
        cloud.normals.push_back(test::unit({-0.6 * p[0] + 0.2 * p[1], 0.2 * p[0] - 0.2 * p[1], 1}));
        cloud.counts.push_back(1);
    }
    const OrientedCloud node{{{0, 0, 0.01}}, {test::unit({0.3, -0.2, 1})}, {1}, {}};
    const double spacing = std::sqrt(4.0 / 3000);
    const Quadric q = fit_quadrics(node, cloud, spacing, {}).front();
    REQUIRE(q.radius > 0);
    CHECK(test::dot(q.axes[2], {0, 0, 1}) > 0.999);
    CHECK(q.radius >= q.min_radius);
    double worst = 0;
    for (const Vec3& p : test::box_cloud(100, {{-0.05, -0.05, 0}, {0.05, 0.05, 0}}, 5))
        worst = std::max(worst, std::abs(q.distance({p[0], p[1], height(p[0], p[1])})));
    CHECK(worst < 0.01 * spacing);
    // The Hessian of the height is ((0.6, -0.2), (-0.2, 0.2)). Its larger eigenvalue is 0.4 + sqrt(0.04 + 0.04).
    CHECK(q.curvature() == Approx(0.4 + std::sqrt(0.08)).epsilon(0.05));
}

TEST_CASE("fit_quadrics: two sheets back to back are fitted separately") {
    for (const unsigned seed : {1, 2, 3}) {
        const std::size_t each = 3000;
        const double spacing = std::sqrt(4.0 / each), apart = 2.5 * spacing;
        OrientedCloud cloud;
        std::mt19937 random(seed);
        std::normal_distribution<double> off(0, 0.2 * spacing);
        std::vector<Vec3> flat = test::box_cloud(int(2 * each), {{-1, -1, 0}, {1, 1, 0}}, seed);
        for (std::size_t n = 0; n < flat.size(); ++n) {
            const bool is_upper = n % 2;
            cloud.points.push_back({flat[n][0], flat[n][1], (is_upper ? 0.5 : -0.5) * apart + off(random)});
            cloud.normals.push_back({0, 0, is_upper ? 1.0 : -1.0});
            cloud.counts.push_back(1);
        }
        const std::vector<Quadric> quadrics = fit_quadrics(cloud, cloud, spacing, {});
        double squares = 0, widest = 0, cosines = 0;
        std::size_t fitted = 0;
        for (std::size_t n = 0; n < quadrics.size(); ++n) {
            if (std::abs(flat[n][0]) > 0.6 || std::abs(flat[n][1]) > 0.6) continue;
            const Quadric& q = quadrics[n];
            REQUIRE(q.radius > 0);
            REQUIRE(q.axes[2][2] * cloud.normals[n][2] > 0);
            cosines += q.axes[2][2] * cloud.normals[n][2];
            squares += std::pow(q.foot()[2] - (n % 2 ? 0.5 : -0.5) * apart, 2);
            widest = std::max(widest, q.radius);
            ++fitted;
        }
        INFO("seed " << seed << ": off by " << std::sqrt(squares / double(fitted)) / spacing << " spacings, widest "
                     << widest / spacing << ", mean cosine " << cosines / double(fitted));
        CHECK(cosines / double(fitted) > 0.96);
        CHECK(std::sqrt(squares / double(fitted)) < 0.1 * spacing);
        // Some neighbourhoods reached the other sheet. The quadrics fit nevertheless, because that sheet's points were
        // left out for their opposite normals.
        CHECK(widest > 2 * apart);
    }
}

TEST_CASE("fit_quadrics: no quadric between two folds if their distances from the indicator are known") {
    for (const bool known : {true, false}) {
        const std::size_t each = 3000;
        const double spacing = std::sqrt(4.0 / each);
        OrientedCloud cloud;
        for (const Vec3& p : test::box_cloud(2 * int(each), {{-1, -1, 0}, {1, 1, 0}}, 9)) {
            // All normals point to one side, as at a narrow gap, so they do not separate the sheets. Only squares_off,
            // the distances from the indicator's surface, shows that a quadric between the sheets is wrong.
            cloud.points.push_back({p[0], p[1], (cloud.size() % 2 ? 0.5 : -0.5) * spacing});
            cloud.normals.push_back({0, 0, 1});
            cloud.counts.push_back(1);
            if (known) cloud.squares_off.push_back(float(0.01 * spacing * spacing));
        }
        const std::vector<Quadric> quadrics = fit_quadrics(cloud, cloud, spacing, {});
        const auto fitted =
            std::count_if(quadrics.begin(), quadrics.end(), [](const Quadric& q) { return q.radius > 0; });
        INFO(fitted << " of " << quadrics.size());
        CHECK((known ? double(fitted) < 0.01 * double(each) : double(fitted) > 0.9 * double(each)));
    }
}

TEST_CASE("fit_quadrics: no quadric at a node whose normal is opposite to those around it") {
    const OrientedCloud cloud = oriented(test::ball(1).sample(3000, 7));
    const double spacing = std::sqrt(4 * M_PI / 3000);
    OrientedCloud nodes = every(cloud, 50);
    for (Vec3& n : nodes.normals) n = test::scaled(-1, n);
    for (const Quadric& q : fit_quadrics(nodes, cloud, spacing, {})) CHECK(q.radius == 0);
    CHECK(fit_quadrics({}, cloud, spacing, {}).empty());
}

TEST_CASE("fit_quadrics: quadrics do not depend on the number of threads") {
    test::SurfaceSample s = test::torus(1, 0.35).sample(3000, 8);
    test::add_noise(s, 0.3 * s.spacing(), 9);
    std::vector<Quadric> of[2];
    for (const int threads : {1, 2}) {
        RunContext run;
        run.threads = threads;
        with_threads(run, [&] { of[threads - 1] = fit_quadrics(oriented(s), oriented(s), s.spacing(), run); });
    }
    for (std::size_t n = 0; n < of[0].size(); ++n) {
        REQUIRE(of[0][n].c == of[1][n].c);
        REQUIRE(of[0][n].axes == of[1][n].axes);
        REQUIRE(of[0][n].radius == of[1][n].radius);
    }
}

TEST_CASE("thinned: counts and centroid are preserved, and both sides of a sheet stay separate") {
    OrientedCloud cloud;
    std::mt19937 random(10);
    std::uniform_real_distribution<float> count(1, 5);
    const double apart = 0.02;
    for (const Vec3& p : test::box_cloud(4000, {{-1, -1, 0}, {1, 1, 0}}, 11)) {
        const double side = cloud.size() % 2 ? 1 : -1;
        cloud.points.push_back({p[0], p[1], 0.3 * p[0] + 0.5 * side * apart});
        cloud.normals.push_back(test::unit({-0.3 * side, 0, side}));
        cloud.counts.push_back(count(random));
    }
    const auto moments = [](const OrientedCloud& c, double side) {
        std::array<double, 4> sum{};
        for (std::size_t n = 0; n < c.size(); ++n) {
            if (c.normals[n][2] * side <= 0) continue;
            sum[3] += double(c.counts[n]);
            for (int a = 0; a < 3; ++a) sum[a] += double(c.counts[n]) * c.points[n][a];
        }
        return sum;
    };
    const OrientedCloud thin = thinned(cloud, 0.2);
    CHECK(thin.size() < 600);
    CHECK(thin.size() >= 200);
    CHECK(thin.normals.size() == thin.size());
    CHECK(thin.counts.size() == thin.size());
    for (const double side : {-1, 1}) {
        const auto before = moments(cloud, side), after = moments(thin, side);
        for (int a = 0; a < 4; ++a) CHECK(after[a] == Approx(before[a]).epsilon(1e-5).margin(1e-2));
    }
    for (std::size_t n = 0; n < thin.size(); ++n) {
        REQUIRE(test::norm(thin.normals[n]) == Approx(1));
        const double side = thin.normals[n][2] > 0 ? 1 : -1;
        REQUIRE(thin.points[n][2] - 0.3 * thin.points[n][0] == Approx(0.5 * side * apart).margin(1e-9));
    }
    CHECK(thinned({}, 1).size() == 0);
}

TEST_CASE("thinned: one mean for each cell of a smooth surface, whatever the direction of its normals") {
    const test::SurfaceSample s = test::ball(1).sample(5000, 12);
    const OrientedCloud thin = thinned(oriented(s), 0.1);
    // The mean of a cell's points lies below the sphere by no more than a chord of the cell does. A cell has one mean,
    // even if its normals are close to a diagonal.
    CHECK(thin.size() == PointCells(s.points, 0.1).cell_count());
    for (std::size_t n = 0; n < thin.size(); ++n) {
        REQUIRE(test::norm(thin.points[n]) > 1 - 0.1 * 0.1);
        REQUIRE(test::dot(thin.normals[n], thin.points[n]) > 0.98);
    }
}

TEST_CASE("fit_quadrics: noise sigma biases the quadrics on a ball by less than 0.4 sigma^2 / R") {
    // If the points of a ball are moved by sigma along each axis, their mean height over a tangent plane is too low by
    // sigma^2 / R.
    double bias = 0;
    int count = 0;
    const double sigma = 0.06;
    for (const unsigned seed : {1, 2, 3}) {
        test::SurfaceSample s = test::ball(1).sample(20000, seed);
        const OrientedCloud nodes = every(oriented(s), 100);
        const double spacing = s.spacing();
        test::add_noise(s, sigma, seed + 10);
        for (const Quadric& q : fit_quadrics(nodes, oriented(s), spacing, {})) {
            if (!(q.radius > 0)) continue;
            bias += std::sqrt(test::dot(q.foot(), q.foot())) - 1;
            ++count;
        }
    }
    INFO("bias " << bias / count / (sigma * sigma) << " sigma^2 / R over " << count);
    REQUIRE(count > 400);
    CHECK(std::abs(bias / count) < 0.4 * sigma * sigma);
}

TEST_CASE("quadrics_over: wide neighbourhoods need fewer quadrics, and every position is near one") {
    test::SurfaceSample s = test::ball(1).sample(40000, 1);
    const double spacing = s.spacing(), edge = 1.2 * spacing;
    const OrientedCloud places = oriented(s);
    test::add_noise(s, spacing, 2);
    std::size_t bare = 1000;
    const std::vector<Quadric> quadrics = quadrics_over(places, oriented(s), edge, spacing, 0, bare, {});
    CHECK(bare < 20);  // number of nodes without a quadric
    CHECK(double(quadrics.size()) < 0.5 * double(thinned(places, edge).size()));
    for (const Quadric& q : quadrics) {
        const double times = q.apart / edge;
        CHECK((times == 1 || times == 2 || times == 4 || times == 8));
        CHECK(q.radius > (times > 1 ? 7 * q.apart : 0));
    }
    // `farthest` is the maximum distance of a position from the nearest quadric's foot, `farthest_beyond` the same less
    // the spacing of that quadric's nodes. `farthest_beyond` may exceed 0, because nodes are means of the points in a
    // cell.
    double farthest = 0, farthest_beyond = 0;
    for (std::size_t n = 0; n < places.size(); n += 10) {
        double nearest = 1, beyond = 1;
        for (const Quadric& q : quadrics) {
            const Vec3 foot = q.foot();
            const Vec3& p = places.points[n];
            const double off = std::hypot(foot[0] - p[0], foot[1] - p[1], foot[2] - p[2]);
            nearest = std::min(nearest, off);
            beyond = std::min(beyond, off - q.apart);
        }
        farthest = std::max(farthest, nearest);
        farthest_beyond = std::max(farthest_beyond, beyond);
    }
    INFO("farthest " << farthest / edge << ", beyond " << farthest_beyond / edge << " cells");
    CHECK(farthest < 3 * edge);
    CHECK(farthest_beyond < 2 * edge);
    // Quadrics fitted to wide neighbourhoods stand for wider cells (Quadric::apart). On a ball without noise no
    // neighbourhood is that wide, so all quadrics keep the cells of edge `edge` that were requested.
    for (const Quadric& q : quadrics_over(places, places, edge, spacing, 0, bare, {})) CHECK(q.apart == edge);
}

TEST_CASE("quadrics_over: points off a sheet cause no quadrics with wide neighbourhoods") {
    test::SurfaceSample s = test::ball(1).sample(8000, 1);
    const double spacing = s.spacing();
    OrientedCloud cloud = oriented(s);
    std::mt19937 random(5);
    for (int n = 0; n < 40; ++n) {
        const std::size_t at = random() % 8000;
        cloud.points.push_back(test::scaled(1.1, s.points[at]));
        cloud.normals.push_back(s.normals[random() % 8000]);
        cloud.counts.push_back(1);
    }
    std::size_t bare = 0;
    double widest = 0;
    for (const Quadric& q : quadrics_over(cloud, cloud, spacing, spacing, 0, bare, {}))
        widest = std::max(widest, q.min_radius);
    INFO("widest " << widest << " spacing " << spacing);
    CHECK(widest < 6 * spacing);
}

TEST_CASE("select_near: points in the ball on the frame's side are selected in order, as by a plain loop") {
    std::mt19937 random(8);
    std::uniform_real_distribution<double> some(-1, 1);
    std::vector<Vec3> places, normals;
    FitCloud cloud;
    for (int n = 0; n < 103; ++n) {
        places.push_back({some(random), some(random), some(random)});
        normals.push_back({some(random), some(random), some(random)});
        const Vec3 &p = places.back(), &m = normals.back();
        cloud.add({p[0], p[1], p[2]}, {m[0], m[1], m[2]}, 1 + n);
    }
    cloud.finish();
    const FitFrame frame{{0.1, -0.2, 0.05}, {{0.6, 0.8, 0}, {-0.8, 0.6, 0}, {0, 0, 1}}, 0.9};
    FitPoints near;
    for (std::size_t begin = 0; begin < places.size(); begin += 7)
        for (std::size_t end = begin; end <= places.size(); ++end) {
            near.clear(end - begin + 5);
            select_near(cloud, 0, 5, frame, near);  // the following results are appended
            select_near(cloud, begin, end, frame, near);
            near.fill_up();
            std::vector<std::size_t> expected;
            const auto expect = [&](std::size_t n) {
                const Vec3 to{places[n][0] - 0.1, places[n][1] + 0.2, places[n][2] - 0.05};
                if (test::dot(to, to) < 0.81 && normals[n][2] > 0) expected.push_back(n);
            };
            for (std::size_t n = 0; n < 5; ++n) expect(n);
            for (std::size_t n = begin; n < end; ++n) expect(n);
            REQUIRE(near.size == expected.size());
            for (std::size_t k = 0; k < expected.size(); ++k) {
                const std::size_t n = expected[k];
                const double x = places[n][0] - 0.1, y = places[n][1] + 0.2, z = places[n][2] - 0.05;
                REQUIRE(near.count[k] == double(1 + n));
                REQUIRE(near.u[k] == Approx((0.6 * x + 0.8 * y) / 0.9).margin(1e-12));
                REQUIRE(near.v[k] == Approx((-0.8 * x + 0.6 * y) / 0.9).margin(1e-12));
                REQUIRE(near.t[k] == Approx(z / 0.9).margin(1e-12));
            }
            for (std::size_t k = near.size; k % kFitLanes != 0; ++k) REQUIRE((near.count[k] == 0 && near.u[k] == 1));
        }
}
