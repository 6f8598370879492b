#include "covol/painted.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "covol/error.h"
#include "painted/outline.h"
#include "painted/segments.h"
#include "support/scratch.h"

using namespace covol;
using detail::Polygon;
using painted::Slice;

namespace {

const double kPi = std::acos(-1.0);

Slice slice_of(int nx, int ny, const std::function<bool(int, int)>& inside) {
    Slice slice;
    slice.nx = nx;
    slice.ny = ny;
    for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i) slice.inside.push_back(inside(i, j));
    return slice;
}

Slice disc(double x, double y, double r) {
    const int n = int(2 * r) + 8;
    return slice_of(n, n, [&](int i, int j) { return std::hypot(i - x, j - y) < r; });
}

double signed_area(const Polygon& line) {
    double twice = 0;
    for (std::size_t n = 0; n < line.size(); ++n) {
        const auto &p = line[n], &q = line[(n + 1) % line.size()];
        twice += p[0] * q[1] - q[0] * p[1];
    }
    return twice / 2;
}

ImageGeometry lattice(Index3 size, Vec3 spacing = {1, 1, 1}) {
    ImageGeometry geometry;
    geometry.size = size;
    geometry.spacing = spacing;
    return geometry;
}

using Label = std::function<int(int, int, int)>;

Image painting(const ImageGeometry& geometry, const Label& label) {
    std::vector<std::uint8_t> values;
    for (int k = 0; k < geometry.size[2]; ++k)
        for (int j = 0; j < geometry.size[1]; ++j)
            for (int i = 0; i < geometry.size[0]; ++i) values.push_back(std::uint8_t(label(i, j, k)));
    return Image::from_values(geometry, values.data());
}

bool in_ball(int i, int j, int k, double middle, double r) {
    return std::hypot(i - middle, std::hypot(j - middle, k - middle)) < r;
}

Painted interpreted(const Image& image, const PaintedOptions& options = {}) {
    return understand_painted(image, find_painted_labels(image), options);
}

}  // namespace

TEST_CASE("The outline of a painted disc lies on its circle", "[painted]") {
    for (const double r : {2.0, 3.0, 5.0, 10.0, 30.0}) {
        double mean = 0, square = 0, worst = 0;
        int count = 0;
        for (int draw = 0; draw < 20; ++draw) {
            const double x = r + 3.5 + 0.37 * std::sin(7.0 * draw), y = r + 3.5 + 0.41 * std::sin(11.0 * draw + 1);
            const std::vector<Polygon> lines = painted::outlines(disc(x, y, r), {});
            REQUIRE(lines.size() == 1);
            for (const auto& p : lines[0]) {
                const double off = std::hypot(p[0] - x, p[1] - y) - r;
                mean += off;
                square += off * off;
                worst = std::max(worst, std::abs(off));
                ++count;
            }
        }
        INFO("radius " << r);
        CHECK(std::abs(mean / count) < 0.03);
        // Without smoothing, the root mean square distance of the staircase from the circle would be 0.235 voxels.
        CHECK(std::sqrt(square / count) < (r < 5 ? 0.21 : 0.14));
        CHECK(worst < 0.55);
    }
}

TEST_CASE("The outline of a staircase of voxels becomes a straight line", "[painted]") {
    for (const double slope : {0.0, 0.2, 0.5, 1.0}) {
        const Slice half = slice_of(60, 90, [&](int i, int j) { return j < 20.3 + slope * i; });
        double worst = 0;
        for (const Polygon& line : painted::outlines(half, {true, true, true, true}))
            for (const auto& p : line) {
                if (p[1] < 0 || p[0] < 0 || p[0] > 59) continue;  // at the image's end, where the outline is cut
                worst = std::max(worst, std::abs(p[1] - 20.3 - slope * p[0]) / std::hypot(1, slope));
            }
        INFO("slope " << slope);
        CHECK(worst < 0.4);
    }
}

TEST_CASE("Smoothing moves no vertex of an outline by more than half a voxel along each axis", "[painted]") {
    const Slice comb = slice_of(
        40, 40, [](int i, int j) { return j > 3 && j < 36 && i > 3 && i < 36 && ((i / 3) % 2 == 0 || j < 8); });
    for (const Polygon& rough : painted::pixel_outlines(comb)) {
        const Polygon line = painted::smoothed(rough);
        REQUIRE(line.size() == rough.size());
        for (std::size_t n = 0; n < line.size(); ++n)
            for (int a = 0; a < 2; ++a) CHECK(std::abs(line[n][a] - rough[n][a]) <= 0.5);
    }
}

TEST_CASE("Outlines are counterclockwise, those of holes clockwise, and voxels at a corner are not joined",
          "[painted]") {
    const auto ring = painted::pixel_outlines(slice_of(20, 20, [](int i, int j) {
        const double d = std::hypot(i - 9.5, j - 9.5);
        return d < 8 && d > 3;
    }));
    REQUIRE(ring.size() == 2);
    CHECK(signed_area(ring[0]) > 0);
    CHECK(signed_area(ring[1]) < 0);
    CHECK(painted::pixel_outlines(slice_of(4, 4, [](int i, int j) {
              return (i == 1 && j == 1) || (i == 2 && j == 2);
          })).size() == 2);
    CHECK(painted::pixel_outlines(slice_of(3, 3, [](int, int) { return false; })).empty());
}

TEST_CASE("An outline is cut at the image's end, half a voxel beyond the last voxel centres", "[painted]") {
    const Slice half = slice_of(30, 30, [](int i, int j) { return std::hypot(i + 0.5, j - 14.5) < 10; });
    const auto cut = painted::outlines(half, {true, false, false, false});
    REQUIRE(cut.size() == 1);
    double left = 1e9;
    for (const auto& p : cut[0]) left = std::min(left, p[0]);
    CHECK(left == -0.5);
    CHECK(signed_area(cut[0]) == Approx(kPi * 50).epsilon(0.01));  // the corners at the image's end are kept
    // Without the image's end, the corners of the same painting are rounded.
    CHECK(signed_area(painted::outlines(half, {})[0]) < kPi * 50 * 0.998);
}

TEST_CASE("Long patches up to 4 voxels wide are strokes, and short or wide ones are not", "[painted]") {
    const auto bar = [](int width, int length) {
        return painted::patches(
                   slice_of(length + 4, width + 4,
                            [&](int i, int j) { return i >= 2 && j >= 2 && i < length + 2 && j < width + 2; }))
            .at(0);
    };
    for (const int width : {1, 2, 3, 4}) {
        CHECK(bar(width, 14 * width).stroke);
        CHECK_FALSE(bar(width, 3 * width).stroke);
    }
    CHECK_FALSE(bar(6, 60).stroke);
    CHECK(bar(3, 10).width == 3);
    CHECK(bar(4, 12).width == 4);
    CHECK(bar(9, 30).width == 9);
    CHECK(painted::patches(slice_of(9, 3, [](int i, int j) { return j == 1 && i != 4; })).size() == 2);
}

TEST_CASE("Separate painted slices are recognised as whole cross-sections, across any axis", "[painted]") {
    const int axis = GENERATE(0, 1, 2);
    const Image image = painting(lattice({40, 40, 40}), [&](int i, int j, int k) {
        const int n = axis == 0 ? i : axis == 1 ? j : k;
        return n % 5 == 0 && in_ball(i, j, k, 19.5, 14) ? 7 : 0;
    });
    const Painted result = interpreted(image);
    REQUIRE(result.labels.size() == 1);
    const PaintedLabel& label = result.labels[0];
    CHECK(label.label == 7);
    CHECK(label.name == "label7");
    CHECK(label.inside.empty());
    REQUIRE(label.views.size() == 1);
    CHECK(label.views[0].axis == axis);
    CHECK(label.views[0].slices == std::vector<int>{10, 15, 20, 25, 30});
    CHECK(label.summary.find("5 slices across " + std::string(1, "xyz"[axis])) != std::string::npos);
    const Contours contours = connect_outlines(label, result.geometry, 1);
    CHECK(contours.slices == 5);
    REQUIRE(contours.solid);
    for (const Vec3& p : contours.marks) CHECK(std::abs(std::hypot(p[0] - 19.5, p[1] - 19.5, p[2] - 19.5) - 14) < 1);
    CHECK(contours.solid->level({19.5, 19.5, 19.5}) < -10);
}

TEST_CASE("Painted slices across two axes, and pairs of adjacent slices, are recognised as cross-sections",
          "[painted]") {
    const Label cross = [](int i, int j, int k) {
        return (k % 6 == 2 || j == 20) && in_ball(i, j, k, 19.5, 15) ? 1 : 0;
    };
    const Painted crossed = interpreted(painting(lattice({40, 40, 40}), cross));
    REQUIRE(crossed.labels[0].views.size() == 2);
    CHECK(crossed.labels[0].views[0].axis == 2);
    CHECK(crossed.labels[0].views[1].axis == 1);
    CHECK(crossed.labels[0].views[1].slices == std::vector<int>{20});
    CHECK(crossed.labels[0].inside.empty());
    const Painted runs = interpreted(painting(
        lattice({40, 40, 40}), [](int i, int j, int k) { return k % 8 < 2 && in_ball(i, j, k, 19.5, 15) ? 1 : 0; }));
    REQUIRE(runs.labels[0].views.size() == 1);
    CHECK(runs.labels[0].views[0].slices.size() == 8);
}

TEST_CASE("A painted ball or stroke is a scribble, unless slices are chosen in the options", "[painted]") {
    const Label ball = [](int i, int j, int k) { return in_ball(i, j, k, 19.5, 5) ? 1 : 0; };
    const Label stroke = [](int i, int j, int k) {
        return k == 12 && std::abs(j - 10 - i / 4) <= 1 && i > 3 && i < 36 ? 1 : 0;
    };
    for (const Label& label : {ball, stroke}) {
        const Image image = painting(lattice({40, 40, 40}), label);
        const Painted result = interpreted(image);
        CHECK(result.labels[0].views.empty());
        CHECK_FALSE(result.labels[0].inside.empty());
        for (const Vec3& p : result.labels[0].inside) CHECK(image.at(int(p[0]), int(p[1]), int(p[2])) == 1);
        CHECK(result.labels[0].summary.find("scribbles") != std::string::npos);
        PaintedOptions slices;
        slices.as = PaintedAs::Slices;
        CHECK(interpreted(image, slices).labels[0].views.size() == 1);
    }
    // Only voxels in a shell of the ball become seeds, because those deeper inside add no information.
    CHECK(interpreted(painting(lattice({40, 40, 40}), ball)).labels[0].inside.size() < 400);
    PaintedOptions scribbles;
    scribbles.as = PaintedAs::Scribbles;
    CHECK(interpreted(painting(lattice({40, 40, 40}),
                               [](int i, int j, int k) { return k == 20 && in_ball(i, j, k, 19.5, 9) ? 1 : 0; }),
                      scribbles)
              .labels[0]
              .views.empty());
}

TEST_CASE("Adjacent painted slices of a body are recognised as cross-sections, across any axis", "[painted]") {
    const int axis = GENERATE(0, 1, 2);
    const auto along_axis = [&](int i, int j, int k) { return axis == 0 ? i : axis == 1 ? j : k; };
    const auto views = [](const Label& label, const ImageGeometry& geometry = lattice({40, 40, 40})) {
        return interpreted(painting(geometry, label)).labels[0].views;
    };
    // The middle eight slices of a ball 14 slices across, half of a ball 20 slices across, and an oblique tube.
    const Label slab = [&](int i, int j, int k) {
        return along_axis(i, j, k) > 15 && along_axis(i, j, k) < 24 && in_ball(i, j, k, 19.5, 7) ? 1 : 0;
    };
    const Label half = [&](int i, int j, int k) {
        return along_axis(i, j, k) > 19 && in_ball(i, j, k, 19.5, 10) ? 1 : 0;
    };
    const Label tube = [&](int i, int j, int k) {
        const double w = along_axis(i, j, k), x = axis == 0 ? j : i, y = axis == 2 ? j : k;
        return w > 8 && w < 30 && std::hypot(x - 14 - 0.3 * w, y - 20) < 6 ? 1 : 0;
    };
    for (const Label& label : {slab, half, tube}) {
        const std::vector<PaintedView> found = views(label);
        REQUIRE(found.size() == 1);
        CHECK(found[0].axis == axis);
    }
    // A cylinder through the whole image.
    CHECK(views([](int i, int j, int) { return std::hypot(i - 19.5, j - 19.5) < 8 ? 1 : 0; }).size() == 1);
}

TEST_CASE("Balls, boxes and strokes of a brush are not taken for cross-sections", "[painted]") {
    const auto is_scribble = [](const Label& label) {
        return interpreted(painting(lattice({60, 60, 60}), label)).labels[0].views.empty();
    };
    const auto distance_to_segment = [](int i, int j, int k, const Vec3& from, const Vec3& to) {
        double along = 0, length = 0;
        const Vec3 p{double(i), double(j), double(k)};
        for (int a = 0; a < 3; ++a) {
            along += (p[a] - from[a]) * (to[a] - from[a]);
            length += (to[a] - from[a]) * (to[a] - from[a]);
        }
        const double t = length > 0 ? std::clamp(along / length, 0.0, 1.0) : 0;
        double distance = 0;
        for (int a = 0; a < 3; ++a) distance = std::hypot(distance, from[a] + t * (to[a] - from[a]) - p[a]);
        return distance;
    };
    for (const double r : {2.5, 3.5, 5.0, 6.2, 8.0, 11.0}) {
        INFO("radius " << r);
        CHECK(is_scribble([&](int i, int j, int k) {
            return distance_to_segment(i, j, k, {30, 30, 30}, {30, 30, 30}) < r ? 1 : 0;
        }));
        CHECK(is_scribble([&](int i, int j, int k) {
            return distance_to_segment(i, j, k, {30.5, 30.5, 30.5}, {30.5, 30.5, 30.5}) < r ? 1 : 0;
        }));
        // A brush that is dragged along a slice, and along its normal.
        CHECK(is_scribble([&](int i, int j, int k) {
            return distance_to_segment(i, j, k, {15, 20, 30}, {44, 30, 30}) < r ? 1 : 0;
        }));
        CHECK(is_scribble([&](int i, int j, int k) {
            return distance_to_segment(i, j, k, {30, 30, 15}, {30, 30, 44}) < r ? 1 : 0;
        }));
    }
    CHECK(is_scribble([](int i, int j, int k) {
        return std::max({std::abs(i - 30), std::abs(j - 30), std::abs(k - 30)}) < 5 ? 1 : 0;
    }));
    // A stroke that was repeated on adjacent slices.
    CHECK(is_scribble(
        [](int i, int j, int k) { return k > 20 && k < 27 && std::abs(j - 30) <= 1 && i > 22 && i < 36 ? 1 : 0; }));
}

TEST_CASE("A stroke between whole painted slices becomes seeds, and the slices become cross-sections", "[painted]") {
    const Painted result = interpreted(painting(lattice({40, 40, 40}), [](int i, int j, int k) {
        if (k % 10 == 0) return in_ball(i, j, k, 19.5, 16) ? 1 : 0;
        return k == 25 && j == 18 && i > 8 && i < 34 ? 1 : 0;
    }));
    REQUIRE(result.labels[0].views.size() == 1);
    CHECK(result.labels[0].views[0].slices == std::vector<int>{10, 20, 30});
    CHECK(result.labels[0].inside.size() == 25);
    CHECK(result.labels[0].inside[0] == Vec3{9, 18, 25});
}

TEST_CASE("Several painted labels are kept apart, and the outside label becomes outside positions", "[painted]") {
    const Image image = painting(lattice({40, 40, 40}), [](int i, int j, int k) {
        if (k % 10 != 0) return 0;
        return in_ball(i, j, k, 19.5, 15) ? (i < 20 ? 3 : 5) : i < 2 ? 9 : 0;
    });
    PaintedOptions options;
    options.outside_label = 9;
    const Painted result = interpreted(image, options);
    REQUIRE(result.labels.size() == 2);
    CHECK(result.labels[0].label == 3);
    CHECK(result.labels[1].label == 5);
    CHECK(result.outside.size() == 4 * 2 * 40);
    options.outside_label = 4;
    CHECK(message_of([&] {
              (void)interpreted(image, options);
          }).find("expected the outside label 4 among its labels, got 3, 5, 9") != std::string::npos);
}

TEST_CASE("Label images that are empty or have fractional values are rejected", "[painted]") {
    CHECK(message_of([] {
              (void)find_painted_labels(painting(lattice({4, 5, 6}), [](int, int, int) { return 0; }));
          }).find("expected painted voxels, got 0 everywhere in 4 x 5 x 6") != std::string::npos);
    std::vector<float> values(27, 0.0F);
    values[13] = 0.5F;
    CHECK(message_of([&] {
              (void)find_painted_labels(Image::from_values(lattice({3, 3, 3}), values.data()));
          }).find("expected whole numbers >= 0, got 0.5 at voxel (1, 1, 1)") != std::string::npos);
}

TEST_CASE("Paint of unknown spacing takes that of the image, and paint that does not fit is rejected", "[painted]") {
    const ImageGeometry image = lattice({10, 10, 10}, {1, 1, 2});
    ImageGeometry unknown = lattice({10, 10, 10});
    unknown.spacing_known = false;
    const Label one = [](int i, int, int) { return i == 9 ? 1 : 0; };
    CHECK(placed_on(painting(unknown, one), image).geometry().spacing[2] == 2);
    CHECK(placed_on(painting(lattice({10, 10, 10}), one), image).geometry().spacing[2] == 1);
    CHECK(placed_on(painting(lattice({10, 10, 10}), one), image, true).geometry().spacing[2] == 2);
    unknown.size = {9, 10, 10};
    CHECK(message_of([&] {
              (void)placed_on(painting(unknown, [](int, int, int) { return 1; }), image);
          }).find("expected as many voxels as the image") != std::string::npos);
    ImageGeometry moved = lattice({10, 10, 10});
    moved.origin = {5, 0, 0};
    CHECK(message_of([&] {
              (void)placed_on(painting(moved, one), image);
          }).find("100 of 100 painted voxels lie outside the image, the first at (9, 0, 0)") != std::string::npos);
}

TEST_CASE("Segment names of 3D Slicer are read from the header of a .seg.nrrd file", "[painted]") {
    const Scratch scratch;
    const std::string path = scratch.write(
        "a.seg.nrrd",
        "NRRD0004\ntype: unsigned char\nSegment0_ID:=Segment_1\nSegment0_LabelValue:=4\n"
        "Segment0_Name:=left kidney\r\nSegment1_Name:=spleen\nSegment1_LabelValue:=2\n\nSegment2_Name:=pixels");
    CHECK(painted::segment_names(path) == std::map<int, std::string>{{2, "spleen"}, {4, "left kidney"}});
    CHECK(painted::segment_names(scratch.path("none.nrrd")).empty());
    CHECK(painted::segment_names("mask.tif").empty());
}
