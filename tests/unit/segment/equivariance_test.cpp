// The result of segment() does not depend on how its input is represented.
#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "covol/pipeline.h"

using namespace covol;

namespace {

constexpr double kMaxDice = 0.002;  // maximum difference of two Dice coefficients
// The same maximum for views with flipped or exchanged axes. It is larger, because the forward differences of the
// minimal surface, the cells of patches and the directions of the hull have no mirror symmetry.
constexpr double kMaxDiceOfTurned = 0.01;

/// Three quarters of a ring that tapers to its ends: thin, curved, with ends. Negative inside.
double horn(const Vec3& p) {
    const double angle = std::clamp(std::atan2(p[1], p[0]), -2.4, 2.4), ring = 15,
                 radius = 4.5 - 1.5 * std::abs(angle) / 2.4;
    return std::hypot(p[0] - ring * std::cos(angle), p[1] - ring * std::sin(angle), p[2]) - radius;
}

/// The scene in other coordinates. @pre the map is an isometry times `unit`
struct View {
    std::array<int, 3> axes{0, 1, 2};  ///< axis a of the view is axes[a] of the scene
    std::array<int, 3> signs{1, 1, 1};
    double unit = 1;       ///< length of the view's unit in units of the scene
    Vec3 origin{0, 0, 0};  ///< added to positions of the view, in its own unit
    double gain = 1, base = 0;
    bool shuffled = false, repeated = false;

    [[nodiscard]] Vec3 to_scene(const Vec3& p) const {
        Vec3 q{};
        for (int a = 0; a < 3; ++a) q[axes[a]] = signs[a] * (p[a] - origin[a]) / unit;
        return q;
    }
    [[nodiscard]] Vec3 of_scene(const Vec3& q) const {
        Vec3 p{};
        for (int a = 0; a < 3; ++a) p[a] = unit * signs[a] * q[axes[a]] + origin[a];
        return p;
    }
};

constexpr std::array kSizes{52, 52, 28};  // of the scene

double noise_at(const Vec3& q) {
    // The random number is derived from the position in the scene, so that the noise is the same in every view.
    std::uint64_t key = 0;
    for (int a = 0; a < 3; ++a) key = key * 1000003 + std::uint64_t(std::llround(2 * q[a]) + 500);
    std::mt19937_64 random(key);
    return std::normal_distribution<double>(0, 12)(random);
}

double dice_of(const View& view) {
    ImageGeometry g;
    for (int a = 0; a < 3; ++a) {
        g.size[a] = kSizes[std::size_t(view.axes[a])];
        g.spacing[a] = view.unit;
        g.origin[a] = view.origin[a] - 0.5 * (g.size[a] - 1) * view.unit;
    }
    std::vector<float> values;
    for (int k = 0; k < g.size[2]; ++k)
        for (int j = 0; j < g.size[1]; ++j)
            for (int i = 0; i < g.size[0]; ++i) {
                const Vec3 q = view.to_scene(g.index_to_world({double(i), double(j), double(k)}));
                const double inside = 0.5 * (1 - std::tanh(2 * horn(q)));
                values.push_back(float(view.base + view.gain * (100 + 60 * inside + noise_at(q))));
            }
    std::mt19937_64 random(8);
    std::uniform_real_distribution<double> wide(-22, 22), half(-0.5, 0.5);
    std::vector<Vec3> marks;
    while (marks.size() < 50) {
        Vec3 q{wide(random), wide(random), wide(random) / 3};
        if (std::abs(horn(q)) > 0.1) continue;
        for (double& x : q) x += half(random);
        marks.push_back(view.of_scene(q));
    }
    if (view.repeated) marks.insert(marks.end(), marks.begin(), marks.begin() + 10);
    if (view.shuffled) std::shuffle(marks.begin(), marks.end(), random);
    const SegmentResult found = segment(Image::from_values(g, values.data()), marks);
    double both = 0, sum = 0;
    const auto at = found.surface->getConstAccessor();
    for (int k = 0; k < g.size[2]; ++k)
        for (int j = 0; j < g.size[1]; ++j)
            for (int i = 0; i < g.size[0]; ++i) {
                const Vec3 p = g.index_to_world({double(i), double(j), double(k)});
                const openvdb::Vec3d index = found.surface->worldToIndex(openvdb::Vec3d(p[0], p[1], p[2]));
                const bool one = at.getValue(openvdb::Coord::round(index)) < 0, other = horn(view.to_scene(p)) < 0;
                both += one && other;
                sum += double(one) + double(other);
            }
    return 2 * both / sum;
}

double reference_dice() {
    static const double dice = dice_of({});
    return dice;
}

}  // namespace

TEST_CASE("Equivariance: the thin body is segmented with a Dice coefficient above 0.9") {
    CHECK(reference_dice() > 0.9);
}

TEST_CASE("Equivariance: shuffled and repeated marks give the same Dice coefficient") {
    CHECK(dice_of({.shuffled = true}) == Approx(reference_dice()).margin(kMaxDice));
    CHECK(dice_of({.repeated = true}) == Approx(reference_dice()).margin(kMaxDice));
}

TEST_CASE("Equivariance: other units and origins give the same Dice coefficient") {
    const double unit = GENERATE(1e-3, 1e3);
    CHECK(dice_of({.unit = unit}) == Approx(reference_dice()).margin(kMaxDice));
    CHECK(dice_of({.unit = unit, .origin = {500 * unit, -700 * unit, 1100 * unit}}) ==
          Approx(reference_dice()).margin(kMaxDice));
}

TEST_CASE("Equivariance: an origin far away gives the same Dice coefficient") {
    CHECK(dice_of({.origin = {1e6, -1e6, 1e6}}) == Approx(reference_dice()).margin(kMaxDice));
}

TEST_CASE("Equivariance: flipped and exchanged axes give the same Dice coefficient within 0.01") {
    CHECK(dice_of({.signs = {-1, 1, 1}}) == Approx(reference_dice()).margin(kMaxDiceOfTurned));
    CHECK(dice_of({.signs = {1, -1, -1}}) == Approx(reference_dice()).margin(kMaxDiceOfTurned));
    CHECK(dice_of({.axes = {1, 0, 2}}) == Approx(reference_dice()).margin(kMaxDiceOfTurned));
    CHECK(dice_of({.axes = {2, 0, 1}}) == Approx(reference_dice()).margin(kMaxDiceOfTurned));
}

TEST_CASE("Equivariance: gain, offset and inversion of the image give the same Dice coefficient") {
    CHECK(dice_of({.gain = 0.01}) == Approx(reference_dice()).margin(kMaxDice));
    CHECK(dice_of({.gain = 3, .base = -5000}) == Approx(reference_dice()).margin(kMaxDice));
    CHECK(dice_of({.gain = -1, .base = 300}) == Approx(reference_dice()).margin(kMaxDice));
}
