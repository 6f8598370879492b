#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "covol/guess_correction.h"
#include "covol/inference.h"
#include "covol/start.h"

using namespace covol;

namespace {

constexpr int kSize = 40;
const Vec3 kMiddle{19.4, 20.2, 19.8};
constexpr double kRadius = 11;

double distance_to_middle(const Vec3& p) { return std::hypot(p[0] - kMiddle[0], p[1] - kMiddle[1], p[2] - kMiddle[2]); }
bool in_truth(const Vec3& p) { return distance_to_middle(p) < kRadius; }
/// The guess is the result of another tool, which lacks everything beyond a plane.
bool in_guess(const Vec3& p) { return in_truth(p) && p[0] < kMiddle[0] + 4; }

ImageGeometry geometry() {
    ImageGeometry g;
    g.size = {kSize, kSize, kSize};
    return g;
}

/// The image of the ball. @param contrast  between inside and outside, in standard deviations of the noise
Image picture(double contrast) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    std::vector<float> values;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i)
                values.push_back(
                    float(contrast / (1 + std::exp((distance_to_middle({i + 0.0, j + 0.0, k + 0.0}) - kRadius) / 0.6)) +
                          normal(random)));
    return Image::from_values(geometry(), values.data());
}

Image mask_of(const std::function<bool(const Vec3&)>& inside) {
    std::vector<std::uint8_t> values;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i) values.push_back(inside({i + 0.0, j + 0.0, k + 0.0}) ? 1 : 0);
    return Image::from_values(geometry(), values.data());
}

FloatGridPtr guess() {
    Domain domain;
    domain.max = {kSize - 1, kSize - 1, kSize - 1};
    return start_from_mask(domain, mask_of(in_guess));
}

/// Marks on the part of the true surface that the guess lacks.
std::vector<Vec3> marks() {
    std::vector<Vec3> places{{kMiddle[0] + kRadius, kMiddle[1], kMiddle[2]}};
    for (int n = 0; n < 4; ++n) {
        const double turn = 0.3 + n * 1.5708, x = 8, r = std::sqrt(kRadius * kRadius - x * x);
        places.push_back({kMiddle[0] + x, kMiddle[1] + r * std::cos(turn), kMiddle[2] + r * std::sin(turn)});
    }
    return places;
}

double dice(const std::function<bool(const Vec3&)>& one, const std::function<bool(const Vec3&)>& other) {
    double both = 0, sum = 0;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i) {
                const Vec3 p{i + 0.0, j + 0.0, k + 0.0};
                both += one(p) && other(p);
                sum += double(one(p)) + double(other(p));
            }
    return 2 * both / sum;
}

std::function<bool(const Vec3&)> inside_of(const FloatGridPtr& u) {
    return [u](const Vec3& p) {
        return u->tree().getValue({int(std::lround(p[0])), int(std::lround(p[1])), int(std::lround(p[2]))}) < 0;
    };
}

}  // namespace

TEST_CASE("A part that the guess lacks according to the marks is redrawn from the image") {
    const FloatGridPtr given = guess();
    const Redrawn redrawn = redraw(given, marks(), picture(6));
    REQUIRE(redrawn.used);
    CHECK(redrawn.bits > 0.5);
    const double before = dice(inside_of(given), in_truth), after = dice(inside_of(redrawn.u), in_truth);
    CHECK(before < 0.92);
    CHECK(after > 0.98);
    // Far from the missing part the result equals the guess.
    CHECK(redrawn.u->tree().getValue({9, 20, 20}) == Approx(given->tree().getValue({9, 20, 20})));

    const GuessCorrection correction = correct_guess(given, marks(), {}, {}, {}, {}, {redrawn.u, redrawn.box});
    const CorrectedMask mask = correction.apply(mask_of(in_guess), 1);
    const auto in_mask = [&](const Vec3& p) {
        return mask.values[std::size_t((p[2] * kSize + p[1]) * kSize + p[0])] == 1;
    };
    CHECK(dice(in_mask, in_truth) > 0.98);
    CHECK(dice(in_mask, inside_of(correction.start())) > 0.99);
    CHECK(mask.removed == 0);
}

TEST_CASE("A guess is not redrawn from an image of noise, nor if its surface passes through the marks") {
    const FloatGridPtr given = guess();
    const Redrawn by_noise = redraw(given, marks(), picture(0));
    CHECK_FALSE(by_noise.used);
    CHECK(by_noise.u == given);
    CHECK(by_noise.bits < 0.3);
    const Redrawn passed = redraw(given, {{kMiddle[0] - kRadius, kMiddle[1], kMiddle[2]}}, picture(6));
    CHECK_FALSE(passed.used);
}

TEST_CASE("A guess without a surface near the marks that it misses is not redrawn") {
    const auto in_corner = [](const Vec3& p) { return std::hypot(p[0] - 4, p[1] - 4, p[2] - 4) < 2.5; };
    Domain domain;
    domain.max = {kSize - 1, kSize - 1, kSize - 1};
    const FloatGridPtr given = start_from_mask(domain, mask_of(in_corner));
    const Redrawn redrawn = redraw(given, {{38, 38, 38}}, picture(6));
    CHECK_FALSE(redrawn.used);
    CHECK(redrawn.u == given);
    CHECK_THAT(redrawn.reason, Catch::Contains("no surface of the guess was found within 30 voxels"));
}

TEST_CASE("Redrawing does not add a bright ball that is separate from the missing part") {
    // A second, equally bright ball, which is near the missing part but separate from it, must not be added.
    const Vec3 other{kMiddle[0] + kRadius + 4, kMiddle[1], kMiddle[2]};
    std::vector<float> values;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i) {
                const double d = std::min(distance_to_middle({i + 0.0, j + 0.0, k + 0.0}) - kRadius,
                                          std::hypot(i - other[0], j - other[1], k - other[2]) - 2.5);
                values.push_back(float(1 / (1 + std::exp(d / 0.4)) + 0.02 * std::sin(1.7 * i + 2.3 * j + 0.9 * k)));
            }
    const Redrawn redrawn = redraw(guess(), marks(), Image::from_values(geometry(), values.data()));
    REQUIRE(redrawn.used);
    const auto inside = inside_of(redrawn.u);
    CHECK_FALSE(inside(other));
    CHECK(dice(inside, in_truth) > 0.97);
}
