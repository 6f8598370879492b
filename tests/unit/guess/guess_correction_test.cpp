#include "covol/guess_correction.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "covol/error.h"
#include "covol/start.h"
#include "support/scratch.h"

using namespace covol;

namespace {

constexpr int kSize = 64;
const Vec3 kMiddle{31.5, 31.5, 31.5};
constexpr double kRadius = 16;

Domain cube() {
    Domain domain;
    domain.max = {kSize - 1, kSize - 1, kSize - 1};
    return domain;
}

double length(const Vec3& p) { return std::hypot(p[0] - kMiddle[0], p[1] - kMiddle[1], p[2] - kMiddle[2]); }

Image ball_mask(double radius, int value = 1, int other_plane = -1) {
    ImageGeometry geometry;
    geometry.size = {kSize, kSize, kSize};
    std::vector<std::uint8_t> values;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i)
                values.push_back(length({double(i), double(j), double(k)}) < radius ? std::uint8_t(value)
                                 : i == other_plane                                 ? 9
                                                                                    : 0);
    return Image::from_values(geometry, values.data());
}

double value_at(const FloatGrid& grid, const Vec3& p) {
    return double(openvdb::tools::BoxSampler::sample(grid.tree(),
                                                     grid.transform().worldToIndex(openvdb::Vec3d(p[0], p[1], p[2]))));
}

Vec3 at(double radius, double theta, double phi) {
    return {kMiddle[0] + radius * std::sin(theta) * std::cos(phi),
            kMiddle[1] + radius * std::sin(theta) * std::sin(phi), kMiddle[2] + radius * std::cos(theta)};
}

}  // namespace

TEST_CASE("The corrected surface passes through a mark, near or far, outside or inside of the guess", "[guess]") {
    const FloatGridPtr guess = start_from_sphere(cube(), kMiddle, kRadius);
    for (const double off : {-7.0, -2.0, 1.0, 3.0, 9.0}) {
        const Vec3 mark = at(kRadius + off, 1.1, 0.4);
        const GuessCorrection correction = correct_guess(guess, {mark}, {}, {});
        INFO("mark " << off << " from the guess");
        CHECK(correction.guess(mark) == Approx(off).margin(0.15));
        CHECK(correction.report().before_max == Approx(std::abs(off)).margin(0.15));
        CHECK(correction.report().after_max < 0.5);
        const FloatGridPtr start = correction.start();
        CHECK(std::abs(value_at(*start, mark)) < 0.6);
        // The opposite side of the ball is unchanged.
        CHECK(value_at(*start, at(kRadius, 1.1 + 3.1, 0.4)) == Approx(0).margin(0.05));
        CHECK(correction.shift(at(kRadius, 1.1 + 3.1, 0.4)) == 0);
    }
}

TEST_CASE("Marks on the guess leave it unchanged, and hold it in place beside other marks", "[guess]") {
    const FloatGridPtr guess = start_from_sphere(cube(), kMiddle, kRadius);
    const Vec3 on = at(kRadius, 1.5, 0.3), off = at(kRadius + 5, 1.5, 0.6);  // 4.8 voxels apart along the ball
    CHECK(std::abs(correct_guess(guess, {on}, {}, {}).shift(on)) < 0.1);
    // The shift is a bump around the mark. Its radius is 12 voxels, the minimum, since 2.2 times the offset of 5 is
    // less. d is the distance from mark to mark.
    const GuessCorrection one = correct_guess(guess, {off}, {}, {});
    const double d = std::sqrt(std::pow(on[0] - off[0], 2) + std::pow(on[1] - off[1], 2) + std::pow(on[2] - off[2], 2)),
                 t = d / 12;
    // The tolerance allows for a second, narrower bump that corrects the remainder.
    CHECK(one.shift(on) == Approx(one.shift(off) * std::pow(1 - t, 4) * (4 * t + 1)).epsilon(0.05));
    const GuessCorrection both = correct_guess(guess, {on, off}, {}, {});
    CHECK(both.report().after_max < 0.5);
    CHECK(std::abs(both.shift(on)) < 0.5);
    CHECK(both.shift(off) == Approx(5).margin(0.5));
}

TEST_CASE("Many marks on another surface move the guess to that surface", "[guess]") {
    const FloatGridPtr guess = start_from_sphere(cube(), kMiddle, kRadius);
    const auto [count, within] = GENERATE(Catch::Generators::table<int, double>({{150, 2.0}, {600, 1.0}}));
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<Vec3> marks;
    const auto radius = [](double theta) { return kRadius + 3 * std::cos(2 * theta); };
    for (int n = 0; n < count; ++n) {
        const double theta = std::acos(1 - 2 * uniform(random)), phi = 6.2831853 * uniform(random);
        marks.push_back(at(radius(theta), theta, phi));
    }
    const GuessCorrection correction = correct_guess(guess, marks, {}, {});
    CHECK(correction.report().before_max > 2.5);
    CHECK(correction.report().after_mean < 0.3);
    const FloatGridPtr start = correction.start();
    double worst = 0;
    for (double theta = 0.1; theta < 3.1; theta += 0.2)
        for (double phi = 0; phi < 6.2; phi += 0.4)
            worst = std::max(worst, std::abs(value_at(*start, at(radius(theta), theta, phi))));
    CHECK(worst < within);
}

TEST_CASE("A missing part is filled without inflating the correct part beside it", "[guess]") {
    // A ball without its cap, which has a quarter of the ball's area and is 0.65 radii high, and ten random marks on
    // the cap.
    constexpr double kPlane = 0.347 * kRadius;
    ImageGeometry geometry = ball_mask(kRadius).geometry();
    std::vector<std::uint8_t> values;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i)
                values.push_back(length({double(i), double(j), double(k)}) < kRadius && k - kMiddle[2] < kPlane);
    const Image mask = Image::from_values(geometry, values.data());
    const FloatGridPtr guess = start_from_mask(cube(), mask);
    const auto dice = [&](const auto& value) {
        std::size_t both = 0, sum = 0, n = 0;
        for (int k = 0; k < kSize; ++k)
            for (int j = 0; j < kSize; ++j)
                for (int i = 0; i < kSize; ++i, ++n) {
                    const bool in_ball = length({double(i), double(j), double(k)}) < kRadius, in = value(n) != 0;
                    both += in_ball && in;
                    sum += std::size_t(in_ball) + std::size_t(in);
                }
        return 2.0 * double(both) / double(sum);
    };
    const double given = dice([&](std::size_t n) { return values[n]; });
    std::mt19937 random(11);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<double> reached;
    for (int draw = 0; draw < 10; ++draw) {
        std::vector<Vec3> marks;
        while (marks.size() < 10) {
            const double height = kPlane + (kRadius - kPlane) * uniform(random);  // Archimedes: uniform on the sphere
            marks.push_back(at(kRadius, std::acos(height / kRadius), 6.2831853 * uniform(random)));
        }
        CAPTURE(draw);
        const GuessCorrection correction = correct_guess(guess, marks, {}, {});
        CHECK(correction.report().depth == Approx(0.5 * (kRadius + kPlane)).margin(2));
        const CorrectedMask corrected = correction.apply(mask, 1);
        reached.push_back(dice([&](std::size_t n) { return corrected.values[n]; }));
        CHECK(reached.back() > given);
        const FloatGridPtr start = correction.start();
        for (const Vec3& mark : marks) CHECK(std::abs(value_at(*start, mark)) < 0.8);
        // On the half of the ball away from the cap, the level set agrees with the mask.
        CHECK(std::abs(value_at(*start, at(kRadius, 2.6, 1))) < 0.6);
        std::size_t n = 0, differ = 0;
        for (int k = 0; k < kSize; ++k)
            for (int j = 0; j < kSize; ++j)
                for (int i = 0; i < kSize; ++i, ++n)
                    differ += (start->tree().getValue({i, j, k}) < 0) != (corrected.values[n] != 0);
        CHECK(differ < 60);
    }
    std::sort(reached.begin(), reached.end());
    CHECK(reached[5] > given + 0.07);
}

TEST_CASE("Voxels beyond the reach of the marks keep their value", "[guess]") {
    const Image mask = ball_mask(kRadius, 200, 2);  // the mask also contains a plane of another label
    const FloatGridPtr guess = start_from_sphere(cube(), kMiddle, kRadius);
    const GuessCorrection correction = correct_guess(guess, {at(kRadius + 4, 0.7, 2), at(kRadius - 3, 2.2, 5)}, {}, {});
    const CorrectedMask corrected = correction.apply(mask, 200);
    CHECK(corrected.added > 50);
    CHECK(corrected.removed > 50);
    std::size_t n = 0, added = 0, removed = 0, reached = 0, wrong = 0;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i, ++n) {
                const int old = int(mask.at(i, j, k)), now = corrected.values[n];
                const double shift = correction.shift({double(i), double(j), double(k)});
                reached += shift != 0;
                added += old == 0 && now == 200;
                removed += old == 200 && now == 0;
                wrong += (shift == 0 && old != now) || (old == 9 && now != 9) || (shift > 0 && old == 200 && now == 0);
            }
    CHECK(wrong == 0);
    CHECK(added == corrected.added);
    CHECK(removed == corrected.removed);
    CHECK(reached == corrected.reached);
    CHECK(reached < mask.geometry().size[0] * std::size_t(kSize) * kSize / 4);
}

TEST_CASE("Seeds on the wrong side move the guess, those on the right side are not counted", "[guess]") {
    const FloatGridPtr guess = start_from_sphere(cube(), kMiddle, kRadius);
    const Vec3 in = at(kRadius + 4, 1, 1), out = at(kRadius - 4, 2, 4);
    const GuessCorrection correction = correct_guess(guess, {}, {in, kMiddle}, {out, {1, 1, 1}});
    CHECK(correction.report().seeds == 2);
    const FloatGridPtr start = correction.start();
    CHECK(value_at(*start, in) < 0);
    CHECK(value_at(*start, out) > 0);
}

TEST_CASE("Without marks a guess is unchanged", "[guess]") {
    const GuessCorrection correction = correct_guess(start_from_sphere(cube(), kMiddle, kRadius), {}, {}, {});
    const CorrectedMask same = correction.apply(ball_mask(kRadius), 1);
    CHECK(same.added + same.removed + same.reached == 0);
    CHECK(value_at(*correction.start(), at(kRadius, 1, 1)) == Approx(0).margin(0.05));
}

TEST_CASE("CorrectionOptions: values out of range are named and rejected", "[guess]") {
    CorrectionOptions options;
    CHECK(why_invalid(options).empty());
    options.precision = -1;
    options.min_radius = -2;
    CHECK(why_invalid(options) == "precision: expected > 0, got -1\nguess_radius: expected > 0, got -2");
    CHECK(code_of([&] { (void)correct_guess(start_from_sphere(cube(), kMiddle, kRadius), {}, {}, {}, options); }) ==
          Errc::InvalidOptions);
}
