#include "covol/inference.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "covol/guess.h"
#include "grid/levels_at.h"
#include "support/shapes.h"

using namespace covol;

namespace {

constexpr int kSize = 64;

/// A horn: three quarters of a ring that tapers to its ends. Negative inside, approximately a distance.
double horn(const Vec3& p) {
    const double angle = std::clamp(std::atan2(p[1], p[0]), -2.4, 2.4), ring = 18,
                 radius = 4 - 1.5 * std::abs(angle) / 2.4;
    return std::hypot(p[0] - ring * std::cos(angle), p[1] - ring * std::sin(angle), p[2]) - radius;
}

double ball(const Vec3& p) { return test::length(p) - 14; }

ImageGeometry geometry() {
    ImageGeometry g;
    g.size = {kSize, kSize, 40};
    for (int a = 0; a < 3; ++a) g.origin[a] = -0.5 * (g.size[a] - 1);
    return g;
}

using Body = double (*)(const Vec3&);

/// The values of an image of a body that is brighter inside by `contrast`, plus noise.
std::vector<float> picture(Body body, double contrast, double noise) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal(0, noise);
    const ImageGeometry g = geometry();
    std::vector<float> values;
    for (int k = 0; k < g.size[2]; ++k)
        for (int j = 0; j < g.size[1]; ++j)
            for (int i = 0; i < g.size[0]; ++i) {
                const Vec3 p = g.index_to_world({double(i), double(j), double(k)});
                const double inside = 0.5 * (1 - std::tanh(2 * body(p)));
                values.push_back(float(100 + contrast * inside + normal(random)));
            }
    return values;
}

/// Random marks on the surface, each moved by up to half a voxel along each axis.
std::vector<Vec3> marks_on(Body body, int count, unsigned seed = 4) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> wide(-30, 30), half(-0.5, 0.5);
    std::vector<Vec3> marks;
    while (int(marks.size()) < count) {
        Vec3 p{wide(random), wide(random), wide(random) / 2};
        if (std::abs(body(p)) > 0.1) continue;
        for (double& x : p) x += half(random);
        marks.push_back(p);
    }
    return marks;
}

FloatGridPtr guess_of(const std::vector<Vec3>& marks) {
    GuessOptions options;
    options.deviation = {{{0.3, 0, 0}, {0, 0.3, 0}, {0, 0, 0.3}}};
    return guess_from_marks(make_domain(geometry().world_box(), 1.0), marks, options).u;
}

/// Dice coefficient of a level set and a body.
double dice(const FloatGrid& u, const std::function<double(const Vec3&)>& body) {
    double both = 0, sum = 0;
    const auto at = u.getConstAccessor();
    test::for_each_voxel(domain_of(u), [&](int i, int j, int k, const Vec3& p) {
        const bool one = at.getValue(test::coord(domain_of(u), i, j, k)) < 0, other = body(p) < 0;
        both += one && other;
        sum += double(one) + double(other);
    });
    return 2 * both / sum;
}

struct Case {
    std::vector<Vec3> marks;
    FloatGridPtr guess;
    Image image;
};

Case horn_case() {
    const std::vector<Vec3> marks = marks_on(horn, 40);
    return {marks, guess_of(marks), Image::from_values(geometry(), picture(horn, 60, 15).data())};
}

bool same(const FloatGrid& a, const FloatGrid& b) {
    return a.tree().hasSameTopology(b.tree()) && [&] {
        for (auto v = a.cbeginValueOn(); v; ++v)
            if (*v != b.tree().getValue(v.getCoord())) return false;
        return true;
    }();
}

}  // namespace

TEST_CASE("Too few marks for a curved body: the image improves the Dice coefficient to above 0.9") {
    const Case c = horn_case();
    const Inferred inferred = infer(*c.guess, c.marks, c.image);
    const double alone = dice(*c.guess, horn), both = dice(*inferred.u, horn);
    INFO("alone " << alone << ", with the image " << both << ", " << inferred.report.reason);
    CHECK(both > 0.9);
    CHECK(both > alone + 0.05);
    CHECK(inferred.report.bits > 0.5);
    CHECK(inferred.report.held_out == 40);
    REQUIRE(inferred.report.expected);
    const double result = inferred.report.used ? both : alone;
    CHECK(inferred.report.expected->low <= result);
    CHECK(result <= inferred.report.expected->high);
    CHECK(inferred.report.expected->value > 0.8);
}

TEST_CASE("The inferred surface is independent of the thread count, the order of the marks and duplicates") {
    const Case c = horn_case();
    const Inferred once = infer(*c.guess, c.marks, c.image);
    RunContext two;
    two.threads = 2;
    CHECK(same(*once.u, *infer(*c.guess, c.marks, c.image, {}, two).u));
    std::vector<Vec3> shuffled = c.marks;
    std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(9));
    shuffled.push_back(shuffled.front());
    CHECK(same(*once.u, *infer(*c.guess, shuffled, c.image).u));
}

TEST_CASE("The inferred surface is equally accurate after gain, offset, inversion and mirroring of the image") {
    const Case c = horn_case();
    const std::vector<float> values = picture(horn, 60, 15);
    const double before = dice(*infer(*c.guess, c.marks, c.image).u, horn);
    for (const auto& [gain, offset] : {std::pair{7.0F, -400.0F}, std::pair{-1.0F, 300.0F}}) {
        std::vector<float> other = values;
        for (float& v : other) v = gain * v + offset;
        const double after = dice(*infer(*c.guess, c.marks, Image::from_values(geometry(), other.data())).u, horn);
        INFO("gain " << gain);
        CHECK(after == Approx(before).margin(0.01));
    }
    const ImageGeometry g = geometry();
    std::vector<float> flipped(values.size());
    for (int k = 0; k < g.size[2]; ++k)
        for (int j = 0; j < g.size[1]; ++j)
            for (int i = 0; i < g.size[0]; ++i)
                flipped[(std::size_t(k) * g.size[1] + j) * g.size[0] + i] =
                    values[(std::size_t(k) * g.size[1] + j) * g.size[0] + (g.size[0] - 1 - i)];
    std::vector<Vec3> marks = c.marks;
    for (Vec3& m : marks) m[0] = -m[0];
    const auto mirrored = [](const Vec3& p) { return horn({-p[0], p[1], p[2]}); };
    const double after = dice(*infer(*guess_of(marks), marks, Image::from_values(g, flipped.data())).u, mirrored);
    CHECK(after == Approx(before).margin(0.01));
}

TEST_CASE("A ball that the guess of minimum bending energy already fits is left unchanged") {
    const std::vector<Vec3> marks = marks_on(ball, 60);
    const FloatGridPtr guess = guess_of(marks);
    const Inferred inferred = infer(*guess, marks, Image::from_values(geometry(), picture(ball, 20, 40).data()));
    CHECK_FALSE(inferred.report.used);
    CHECK(same(*inferred.u, *guess));
    CHECK(inferred.report.weight_of_guess >= 0.5);
    REQUIRE(inferred.report.expected);
    CHECK(inferred.report.expected->value > 0.9);
}

TEST_CASE("A constant image or one of pure noise does not make the surface worse than the guess") {
    const std::vector<Vec3> marks = marks_on(ball, 60);
    const FloatGridPtr guess = guess_of(marks);
    for (const double noise : {30.0, 0.0}) {
        const Inferred inferred = infer(*guess, marks, Image::from_values(geometry(), picture(ball, 0, noise).data()));
        INFO("noise " << noise << ": " << inferred.report.reason);
        CHECK(dice(*inferred.u, ball) > dice(*guess, ball) - 0.005);
    }
}

TEST_CASE("An outside seed lies outside of an inferred surface, and correct seeds keep the Dice above 0.9") {
    const Case c = horn_case();
    const std::vector<Vec3> middle{{18, 0, 0}};
    // The seed states that the middle of the horn's thick part is outside. If the result is used, it has a hole there.
    const Inferred inferred = infer(*c.guess, c.marks, c.image, {{}, middle});
    if (inferred.report.used) CHECK(detail::levels_at(*inferred.u, middle)[0] > 0);
    const Inferred right = infer(*c.guess, c.marks, c.image, {middle, {{0, 0, 0}}});
    CHECK(dice(*right.u, horn) > 0.9);
    CHECK(detail::levels_at(*right.u, middle)[0] < 0);
}

TEST_CASE("Ten marks are too few for inference: the guess is kept, and the reason is reported") {
    const std::vector<Vec3> marks = marks_on(ball, 10);
    const FloatGridPtr guess = guess_of(marks);
    const Image image = Image::from_values(geometry(), picture(ball, 60, 5).data());
    const Inferred inferred = infer(*guess, marks, image);
    CHECK_FALSE(inferred.report.used);
    CHECK(inferred.report.reason.find("10 marks") != std::string::npos);
    CHECK_FALSE(inferred.report.expected);
    CHECK(same(*inferred.u, *guess));
}

TEST_CASE("At least five of six wrong marks among 60 are reported, and the Dice drops by less than 0.02") {
    std::vector<Vec3> marks = marks_on(horn, 60);
    const Image image = Image::from_values(geometry(), picture(horn, 60, 15).data());
    const double right = dice(*infer(*guess_of(marks), marks, image).u, horn);
    std::vector<Vec3> wrong;
    std::mt19937 random(2);
    std::uniform_real_distribution<double> wide(-24, 24);
    while (wrong.size() < 6) {
        const Vec3 p{wide(random), wide(random), wide(random) / 2};
        if (std::abs(horn(p)) < 5) continue;
        wrong.push_back(p);
        marks[wrong.size()] = p;
    }
    const Inferred inferred = infer(*guess_of(marks), marks, image);
    REQUIRE(inferred.report.used);
    CHECK(dice(*inferred.u, horn) > right - 0.02);
    const std::vector<Vec3>& named = inferred.report.wrong_marks;
    for (const Vec3& p : named) CHECK(std::find(wrong.begin(), wrong.end(), p) != wrong.end());
    CHECK(named.size() >= 5);
    CHECK(inferred.marks.size() == marks.size() - named.size());
}
