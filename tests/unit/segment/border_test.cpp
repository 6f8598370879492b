#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "covol/error.h"
#include "covol/start.h"
#include "segment/doubts.h"
#include "segment/start/starts.h"
#include "support/clouds.h"
#include "support/scratch.h"

using namespace covol;
using pipeline::Problem;

namespace {

constexpr int kSize = 32;

Image blank_image() {
    ImageGeometry geometry;
    geometry.size = {kSize, kSize, kSize};
    const std::vector<std::uint8_t> values(std::size_t(kSize) * kSize * kSize, 0);
    return Image::from_values(geometry, values.data());
}

/// A level set whose outside, as far as the image extends, is a small ball.
FloatGridPtr inverted_ball(const Image& image, const Vec3& center, double radius) {
    const FloatGridPtr u = start_from_sphere(make_domain(image.geometry().world_box(), 1), center, radius);
    for (auto value = u->beginValueAll(); value; ++value) value.setValue(-*value);
    u->tree().root().setBackground(-u->background(), false);
    return u;
}

std::vector<Vec3> marks_around(const Vec3& center, double radius) {
    std::vector<Vec3> marks;
    for (int a = 0; a < 3; ++a)
        for (const double side : {-radius, radius}) {
            marks.push_back(center);
            marks.back()[a] += side;
        }
    return marks;
}

}  // namespace

TEST_CASE("A surface that is inside out is rejected, unless marks, seeds or the start put the border inside") {
    const Image image = blank_image();
    const RunContext run;
    const Vec3 center{6, 25, 24};
    const std::vector<Vec3> marks = marks_around(center, 5), all_over = marks_around({15.5, 15.5, 15.5}, 15), none;
    const FloatGridPtr inverted = inverted_ball(image, center, 5);
    const SegmentOptions plain;
    const Problem problem(&image, marks, plain, run);
    CHECK_NOTHROW(pipeline::require_outside(
        problem, *start_from_sphere(make_domain(image.geometry().world_box(), 1), center, 5), {}));
    CHECK(message_of([&] { pipeline::require_outside(problem, *inverted, {}); }).find("is inside out: ") !=
          std::string::npos);
    // A surface that is inside out is allowed if marks or seeds lie all over the image's border, or if the start was
    // given explicitly.
    CHECK_NOTHROW(pipeline::require_outside(Problem(&image, all_over, plain, run), *inverted, {}));
    SegmentOptions seeds;
    seeds.inside = all_over;
    CHECK_NOTHROW(pipeline::require_outside(Problem(&image, marks, seeds, run), *inverted, {}));
    const Problem named(&image, none, plain, run);
    CHECK_THROWS_AS(pipeline::require_outside(named, *inverted, {}), Error);
    CHECK_NOTHROW(pipeline::require_outside(named, *inverted, pipeline::inside_on_border(named, *inverted)));
}

TEST_CASE("Points that continue a cut body beyond the image attract, but are not among the marks that can be missed") {
    const Image image = blank_image();
    const RunContext run;
    std::vector<Vec3> marks = test::sphere_cloud(1000, 8, 1, {3, 15.5, 15.5});
    std::erase_if(marks, [](const Vec3& mark) { return mark[0] < 0; });
    SegmentOptions options;
    options.start = TagStart{};
    const Problem problem(&image, marks, options, run);
    const pipeline::Resolved resolved = pipeline::resolve(problem);
    const pipeline::StartSurface start = pipeline::make_start(problem, resolved.choices, resolved.marks);
    const auto is_beyond = [](const Vec3& mark) { return mark[0] < -0.5; };
    const std::vector<Vec3>&attracting = start.facts.marks.attracting, &trusted = start.facts.marks.trusted;
    CHECK(std::any_of(attracting.begin(), attracting.end(), is_beyond));
    CHECK(std::none_of(trusted.begin(), trusted.end(), is_beyond));
    CHECK(trusted.size() > 500);
    CHECK_FALSE(pipeline::misses_marks(problem, start.facts, *start.u));
}
