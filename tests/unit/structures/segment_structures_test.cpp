#include "covol/segment_structures.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "covol/error.h"
#include "covol/level_set.h"

using namespace covol;

namespace {

constexpr int kSize = 40;
constexpr double kRadius = 8;

/// The centres of two balls of radius kRadius, which overlap by 6 voxels and are symmetric about the plane x = 20.
const Vec3 kLeft{15, 20, 20}, kRight{25, 20, 20};

double distance(const Vec3& a, const Vec3& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

Image scene(double shift = 0) {
    ImageGeometry geometry;
    geometry.size = {kSize, kSize, kSize};
    std::vector<float> values;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i) {
                const Vec3 p{i - shift, double(j), double(k)};
                const double d = std::min(distance(p, kLeft), distance(p, kRight)) - kRadius;
                values.push_back(float(100 * std::clamp(0.5 - d, 0.0, 1.0)));
            }
    return Image::from_values(geometry, values.data());
}

Marks ball(const std::string& name, const Vec3& center, int count = 400) {
    Marks marks;
    marks.name = name;
    for (int n = 0; n < count; ++n) {
        const double z = 1 - (2 * n + 1.0) / count, r = std::sqrt(1 - z * z), turn = 2.399963 * n;
        marks.points.push_back({center[0] + kRadius * r * std::cos(turn), center[1] + kRadius * r * std::sin(turn),
                                center[2] + kRadius * z});
    }
    return marks;
}

StructuresOptions points_alone() {
    StructuresOptions options;
    options.segment.evolve.rho = 0;
    return options;
}

}  // namespace

TEST_CASE("Overlapping structures are separated first, and then measured") {
    RunContext run;
    std::vector<std::string> lines;
    run.log = [&](LogLevel, const std::string& line) { lines.push_back(line); };
    const StructuresResult found =
        segment_structures(scene(), {ball("left", kLeft), ball("right", kRight)}, points_alone(), run);
    CHECK(std::any_of(lines.begin(), lines.end(), [](const std::string& line) {
        return line.find("'left' and 'right' overlapped by") != std::string::npos;
    }));
    REQUIRE(found.structures.size() == 2);
    REQUIRE(found.overlaps.size() == 1);
    for (const StructureResult& s : found.structures) {
        CHECK(s.result.surface->getName() == s.name);
        const SegmentReport& report = s.result.report;
        const std::vector<double> levels = LevelSet(s.result.surface).sample(s.marks);
        // Marks on the part of a cap that was assigned to the other structure lie outside, by up to 3 voxels.
        std::size_t off = 0;
        double sum = 0, sign = 0;
        for (const Vec3& mark : s.marks) {
            const double beyond = s.name == "left" ? mark[0] - 20 : 20 - mark[0];
            off += beyond > report.marks_off.beyond + 0.3;
            sum += std::max(0.0, beyond);
        }
        for (const double level : levels) sign += level;
        CHECK(report.marks_off.count >= off);
        CHECK(off > 10);
        CHECK(report.marks_off.farthest == Approx(3).margin(0.3));
        CHECK(report.fit.max == Approx(report.marks_off.farthest));
        // The distances are within the band (3 voxels), so that the bias is the mean of the signed distances.
        CHECK(report.fit.bias == Approx(sign / double(s.marks.size())).margin(0.05));
        CHECK(report.fit.bias == Approx(sum / double(s.marks.size())).margin(0.15));
        // Where the two bodies overlap, each position goes to one of them, so the other one's marks there cannot lie on
        // its surface. They cause no warning.
        CHECK(std::none_of(report.warnings.begin(), report.warnings.end(), [](const std::string& line) {
            return line.find("from the surface, the farthest") != std::string::npos;
        }));
    }
}

TEST_CASE("A single structure gives the same result as segment()") {
    const Marks marks = ball("", kLeft);
    const StructuresResult found = segment_structures(scene(), {marks}, points_alone());
    SegmentOptions options = points_alone().segment;
    options.voxel_size = 1;
    options.voxel_size_may_grow = true;
    const SegmentResult alone = segment(scene(), marks.points, options);
    CHECK(found.structures.at(0).result.report.surface.volume == alone.report.surface.volume);
    CHECK(found.structures[0].result.report.fit.bias == alone.report.fit.bias);
    CHECK(found.structures[0].grid == "surface");
    CHECK_THROWS_AS(segment_structures({}, {ball("a", kLeft), ball("b", kRight)}), Error);
}

TEST_CASE("A frame of a time-lapse starts from the previous one, and a failed frame is skipped") {
    TimeLapse lapse;
    CHECK_THROWS_AS(lapse.segment(scene(), {Marks{}}), Error);  // neither marks nor a start
    CHECK_FALSE(lapse.started());
    StructuresOptions options;
    const StructuresResult first = lapse.segment(scene(), {ball("", kLeft)}, options);
    REQUIRE(lapse.started());
    const double delta = first.structures.at(0).result.report.resolved.evolve.delta.value();
    const StructuresResult second = lapse.segment(scene(1), {Marks{}}, options);
    const SegmentReport& report = second.structures.at(0).result.report;
    CHECK(is_any<LevelSetStart>(report.resolved.start));
    CHECK(report.resolved.evolve.delta == delta);
    Marks other;
    other.name = "other";
    CHECK_THROWS_AS(lapse.segment(scene(2), {other}, options), Error);
    CHECK_NOTHROW(lapse.segment(scene(2), {Marks{}}, options));
}
