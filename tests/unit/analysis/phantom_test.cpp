#include "covol/phantom.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "covol/error.h"

using namespace covol;

namespace {

constexpr double kPi = std::numbers::pi;

PhantomOptions options_of(const std::string& kind, int size = 64, int points = 200) {
    PhantomOptions options;
    options.kind = kind;
    options.size = size;
    options.point_count = points;
    return options;
}

double voxel_volume(const Phantom& phantom) { return std::pow(phantom.image.geometry().spacing[0], 3); }

double label_volume(const Phantom& phantom) {
    return voxel_volume(phantom) * static_cast<double>(std::count(phantom.labels.begin(), phantom.labels.end(), 1));
}

double bright_volume(const Phantom& phantom) {
    const auto& size = phantom.image.geometry().size;
    double sum = 0;
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i) sum += phantom.image.at(i, j, k) / 255.0;
    return sum * voxel_volume(phantom);
}

double norm(const Vec3& p) { return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]); }

}  // namespace

TEST_CASE("Phantoms have the analytic volume, in the labels to 6 % and with partial voxels in the image to 1 %") {
    const auto [kind, volume] = GENERATE(table<std::string, double>({
        {"sphere", 4.0 / 3 * kPi * 0.8 * 0.8 * 0.8},
        {"torus", 2 * kPi * kPi * 0.75 * 0.3 * 0.3},
        {"box", 8 * 0.9 * 0.7 * 0.5},
        {"two-spheres", 2 * 4.0 / 3 * kPi * 0.45 * 0.45 * 0.45},
    }));
    const Phantom phantom = make_phantom(options_of(kind));
    INFO(kind);
    // Labels are whole voxels, with edges of about 1/25, but the faces of the box lie between voxel centres. Therefore
    // each side of the labelled box is off by up to half a voxel at each end.
    CHECK(label_volume(phantom) == Approx(volume).epsilon(kind == "box" ? 0.06 : 0.03));
    CHECK(bright_volume(phantom) == Approx(volume).epsilon(0.01));
}

TEST_CASE("Phantom points lie within two voxels of the boundary of the labels") {
    const std::string kind = GENERATE(from_range(list_phantom_kinds()));
    const Phantom phantom = make_phantom(options_of(kind));
    INFO(kind);
    REQUIRE(phantom.points.size() == 200);
    const ImageGeometry& g = phantom.image.geometry();
    for (const Vec3& p : phantom.points) {
        int inside = 0, outside = 0;  // numbers of labelled and unlabelled voxels among the 64 around the point
        for (int c = 0; c < 64; ++c) {
            Index3 at;
            for (int a = 0; a < 3; ++a)
                at[a] = int(std::floor((p[a] - g.origin[a]) / g.spacing[a])) - 1 + (c >> 2 * a & 3);
            const bool label = phantom.labels[(std::size_t(at[2]) * g.size[1] + at[1]) * g.size[0] + at[0]];
            ++(label ? inside : outside);
        }
        REQUIRE(inside > 0);
        REQUIRE(outside > 0);
    }
}

TEST_CASE("Phantom points are distributed uniformly by area over sphere, torus and box") {
    // The mean of a function over points that are uniform by area equals its mean over the surface: |z| on a sphere has
    // the mean r/2, z^2 on a torus with a tube of radius r has the mean r^2/2. The mean of x^2 on the box is the
    // area-weighted mean over its faces.
    const int n = 20000;
    const auto mean = [](const Phantom& phantom, auto f) {
        double sum = 0;
        for (const Vec3& p : phantom.points) sum += f(p);
        return sum / static_cast<double>(phantom.points.size());
    };
    CHECK(mean(make_phantom(options_of("sphere", 16, n)), [](const Vec3& p) { return std::abs(p[2]); }) ==
          Approx(0.4).margin(0.01));
    CHECK(mean(make_phantom(options_of("torus", 16, n)), [](const Vec3& p) { return p[2] * p[2]; }) ==
          Approx(0.3 * 0.3 / 2).margin(0.001));
    // If points were uniform in the angle around the tube, their mean distance from the torus's axis would be R = 0.75,
    // the radius of the ring. As they are uniform by area, it is R + r^2 / (2R), with r = 0.3 the radius of the tube.
    CHECK(mean(make_phantom(options_of("torus", 16, n)), [](const Vec3& p) { return std::hypot(p[0], p[1]); }) ==
          Approx(0.75 + 0.09 / 1.5).margin(0.005));
    const double x_faces = 0.7 * 0.5, others = 0.9 * (0.7 + 0.5);
    CHECK(mean(make_phantom(options_of("box", 16, n)), [](const Vec3& p) { return p[0] * p[0]; }) ==
          Approx((x_faces * 0.81 + others * 0.27) / (x_faces + others)).margin(0.01));
}

TEST_CASE("Spheres with holes: a shell with holes at the poles of all axes, and points on the sphere") {
    const double radius = std::sqrt(3.0) / 2;
    const std::string kind = GENERATE("sphere-round", "sphere-square", "sphere-slit");
    const Phantom phantom = make_phantom(options_of(kind, 104, 500));
    const ImageGeometry& g = phantom.image.geometry();
    INFO(kind);
    for (const Vec3& p : phantom.points) REQUIRE(norm(p) == Approx(radius));
    const auto value_at = [&](const Vec3& p) {
        const Vec3 at = {(p[0] - g.origin[0]) / g.spacing[0], (p[1] - g.origin[1]) / g.spacing[1],
                         (p[2] - g.origin[2]) / g.spacing[2]};
        return phantom.image.at(int(std::lround(at[0])), int(std::lround(at[1])), int(std::lround(at[2])));
    };
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 pole{0, 0, 0};
        pole[axis] = radius;
        CHECK(value_at(pole) == 0);
        // In sphere-slit, the slit at the pole on the x axis is long along y, the one on y along z, and the one on z
        // along x, so that `side` lies in the slit and `other` beside it.
        Vec3 side = pole, other = pole;
        side[(axis + 1) % 3] = 0.2;
        other[(axis + 2) % 3] = 0.2;
        side[axis] = other[axis] = std::sqrt(radius * radius - 0.04);
        CHECK(value_at(side) == 0);
        CHECK(value_at(other) == (kind == "sphere-slit" ? 255 : 0));
    }
    // The position is not (0.5, 0.5, 0.5), which is halfway between voxels, so that lround() would choose a voxel
    // outside of the shell.
    CHECK(value_at({0.52, 0.52, std::sqrt(radius * radius - 2 * 0.52 * 0.52)}) == 255);
    CHECK(value_at({0, 0, 0}) == 0);
}

TEST_CASE("Phantoms: the seed determines the points and the noise, which has the given standard deviation") {
    PhantomOptions options = options_of("sphere", 32, 50);
    options.noise = 0.1;
    const Phantom a = make_phantom(options), b = make_phantom(options);
    options.seed = 2;
    const Phantom c = make_phantom(options);
    CHECK(a.points == b.points);
    CHECK(a.points != c.points);
    const ImageGeometry& g = a.image.geometry();
    double sum = 0, squares = 0;
    int same = 0, count = 0;
    // The first four slices lie outside the ball, where the value without noise is 0. Negative values are clipped by
    // the range of a byte: what remains has the mean noise / sqrt(2 pi) and the mean square noise^2 / 2.
    for (int i = 0; i < 32; ++i)
        for (int j = 0; j < 32; ++j)
            for (int k = 0; k < 4; ++k) {
                const double v = a.image.at(i, j, k) / 255.0;
                CHECK(v == b.image.at(i, j, k) / 255.0);
                same += v == c.image.at(i, j, k) / 255.0 && v > 0;
                sum += v;
                squares += v * v;
                ++count;
            }
    CHECK(g.size == Index3{32, 32, 32});
    CHECK(sum / count == Approx(0.1 / std::sqrt(2 * kPi)).epsilon(0.06));
    CHECK(squares / count == Approx(0.005).epsilon(0.08));
    CHECK(same < count / 20);
}

TEST_CASE("Phantom options that are out of range are rejected") {
    PhantomOptions options;
    CHECK(why_invalid(options).empty());
    options.kind = "cube";
    CHECK(why_invalid(options).find("kind: expected one of list_phantom_kinds()") != std::string::npos);
    CHECK_THROWS_WITH(make_phantom(options), Catch::Contains("kind: expected one of sphere, torus"));
    CHECK_THROWS_AS(make_phantom(options), Error);
    options = {};
    options.size = 15;
    CHECK_THROWS_AS(make_phantom(options), Error);
    options = {};
    options.noise = -1;
    CHECK_THROWS_AS(make_phantom(options), Error);
    options = {};
    options.point_count = -1;
    CHECK_THROWS_AS(make_phantom(options), Error);
}

TEST_CASE("The spheres with holes equal the stored phantoms", "[data]") {
    const char* folder = std::getenv("COVOL_DATA");
    if (folder == nullptr) {
        WARN("SKIPPED: COVOL_DATA is not set");
        return;
    }
    const std::string name = GENERATE("round", "square", "slit");
    const Image stored = read_image(std::string(folder) + "/phantoms/sphere_" + name + ".nrrd");
    const Phantom made = make_phantom(options_of("sphere-" + name, 260, 0));
    const ImageGeometry &a = stored.geometry(), &b = made.image.geometry();
    REQUIRE(a.size == b.size);
    for (int axis = 0; axis < 3; ++axis) {
        CHECK(a.spacing[axis] == Approx(b.spacing[axis]));
        CHECK(a.origin[axis] == Approx(b.origin[axis]));
    }
    long differ = 0;
    for (int k = 0; k < 260; ++k)
        for (int j = 0; j < 260; ++j)
            for (int i = 0; i < 260; ++i) differ += stored.at(i, j, k) != made.image.at(i, j, k);
    CHECK(differ == 0);
}
