#include "covol/marks.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "covol/error.h"

using namespace covol;

namespace {

constexpr int kSize = 24;

ImageGeometry lattice() {
    ImageGeometry geometry;
    geometry.size = {kSize, kSize, kSize};
    return geometry;
}

Image labels(const std::function<int(int, int, int)>& label) {
    std::vector<std::uint8_t> values;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i) values.push_back(std::uint8_t(label(i, j, k)));
    return Image::from_values(lattice(), values.data());
}

bool in_ball(int i, int j, int k, double x, double r) { return std::hypot(i - x, j - 11.5, k - 11.5) < r; }

/// Label 1 on discs in every fourth slice, and on two specks in adjacent slices that are not tips of a body.
int discs(int i, int j, int k) {
    if (k % 4 == 0 && in_ball(i, j, k, 11.5, 8)) return 1;
    return (k == 1 || k == 2) && (i == 11 || i == 12) && (j == 11 || j == 12) ? 1 : 0;
}

std::shared_ptr<const PaintedImage> painted(const Image& image, const PaintedOptions& options = {},
                                            const std::string& name = "") {
    PaintedImage made = make_painted(image, options);
    made.name = name;
    return std::make_shared<const PaintedImage>(std::move(made));
}

PointCloud cloud(std::vector<Vec3> points) {
    PointCloud made;
    made.points = std::move(points);
    made.stated = true;
    return made;
}

Marks named(const std::string& name) {
    Marks marks;
    marks.name = name;
    return marks;
}

SegmentOptions with_voxels_of(double h) {
    SegmentOptions options;
    options.voxel_size = h;
    return options;
}

}  // namespace

TEST_CASE("Clouds with and without normals and sensors are joined, with one hint for each point") {
    Marks marks;
    add_points(marks, cloud({{1, 0, 0}}), {});
    PointCloud scan = cloud({{2, 0, 0}, {3, 0, 0}});
    scan.sensor = Vec3{2, 0, 5};
    add_points(marks, scan, {});
    PointCloud oriented = cloud({{4, 0, 0}});
    oriented.normals = {{0, 1, 0}};
    add_points(marks, oriented, {});
    CHECK(marks.points == std::vector<Vec3>{{1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}});
    CHECK(marks.hints.normals == std::vector<Vec3>{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 1, 0}});
    REQUIRE(marks.hints.to_sensor.size() == 4);
    CHECK(marks.hints.to_sensor[0] == Vec3{0, 0, 0});
    CHECK(marks.hints.to_sensor[1] == Vec3{0, 0, 1});
    CHECK(marks.count == 4);
    CHECK_THROWS_AS(add_points(marks, cloud({{100, 0, 0}}), lattice()), Error);
}

TEST_CASE("Points are thinned together with their hints") {
    Marks marks;
    PointCloud oriented;
    for (int n = 0; n < 100; ++n) {
        oriented.points.push_back({double(n), 0, 0});
        oriented.normals.push_back({0, double(n), 0});
    }
    add_points(marks, oriented, {});
    thin_points(marks, 10);
    REQUIRE(marks.points.size() == 10);
    CHECK(marks.thinned == 10u);
    CHECK(marks.count == 100);
    for (std::size_t n = 0; n < 10; ++n) CHECK(marks.hints.normals[n][1] == marks.points[n][0]);
    thin_points(marks, 0);
    CHECK(marks.points.size() == 10);
}

TEST_CASE("Painted labels are assigned to structures by name, and a single label to unnamed marks") {
    const Image two = labels([](int i, int j, int k) { return in_ball(i, j, k, 11.5, 8) ? (i < 12 ? 7 : 3) : 0; });
    std::vector<Marks> structures{named("label7")};
    add_paint(structures, {painted(two)});
    REQUIRE(structures.size() == 2);
    CHECK(structures[0].paint.at(0).label == 7);
    CHECK(structures[1].name == "label3");
    number_labels(structures);
    CHECK(structures[0].label == 7);
    CHECK(structures[1].label == 3);

    const Image one = labels(discs);
    std::vector<Marks> unnamed{Marks{}};
    add_paint(unnamed, {painted(one)});
    REQUIRE(unnamed.size() == 1);
    CHECK(unnamed[0].paint.size() == 1);
    std::vector<Marks> none;
    add_paint(none, {painted(one)});
    CHECK(none.at(0).name.empty());
    std::vector<Marks> other{named("other")};
    add_paint(other, {painted(one, {}, "ve")});
    CHECK(other.at(1).name == "ve");
    number_labels(other);
    CHECK(other[1].label == 1);  // its own label
    CHECK(other[0].label == 2);  // the first free one
}

TEST_CASE("A guess is one label of a mask, and ambiguous or missing labels are rejected") {
    const Image two = labels([](int i, int j, int k) { return in_ball(i, j, k, 11.5, 8) ? (i < 12 ? 7 : 3) : 0; });
    const GivenGuess guess = make_guess(two, 3, lattice());
    CHECK(guess.label == 3);
    CHECK(std::get<MaskStart>(guess.start).mask->at(14, 11, 11) == 1);
    CHECK(std::get<MaskStart>(guess.start).mask->at(8, 11, 11) == 0);
    CHECK(guess.mask->at(8, 11, 11) == 7);
    CHECK_THROWS_WITH(make_guess(two, 0, {}), Catch::Contains("expected one label, got 3, 7"));
    CHECK_THROWS_WITH(make_guess(two, 4, {}),
                      Catch::Contains("expected one of the labels") && Catch::Contains("got 4"));
    CHECK(make_guess(labels(discs), 0, {}).label == 1);
}

TEST_CASE("Painted slices become contours, and other paint becomes seeds that are counted separately") {
    std::vector<Marks> structures(1);
    structures[0].inside.push_back(cloud({{11, 11, 11}}));
    add_paint(structures, {painted(labels(discs))});
    const StructureInput input = prepare_marks(structures, lattice(), with_voxels_of(1)).at(0);
    REQUIRE(input.options.contours);
    CHECK(input.options.contours->slices == 4);
    CHECK(input.marks == input.options.contours->marks);
    CHECK(input.count == input.marks.size());
    CHECK(input.options.inside.size() == 9);
    CHECK(input.options.painted_seeds == 8);
    CHECK(input.paint.at(0).second.label == 1);
    CHECK(input.contour_rules.empty());  // the rules are empty because the contours are not written to any file
}

TEST_CASE("Paint of one structure is outside of the others, and the outside label is outside of all") {
    const Image scribbles = labels([](int i, int j, int k) {
        return in_ball(i, j, k, 5, 3) ? 1 : in_ball(i, j, k, 18, 3) ? 2 : k == 22 && j < 4 && i < 4 ? 9 : 0;
    });
    const PaintedOptions options{PaintedAs::Scribbles, 9};
    std::vector<Marks> structures;
    add_paint(structures, {painted(scribbles, options)});
    const std::vector<StructureInput> inputs = prepare_marks(structures, lattice(), with_voxels_of(1));
    REQUIRE(inputs.size() == 2);
    for (std::size_t n = 0; n < 2; ++n) {
        const std::size_t own = inputs[n].options.inside.size(), other = inputs[1 - n].options.inside.size();
        CHECK(own > 20);
        CHECK(inputs[n].options.outside.size() == other + 16);
        CHECK(inputs[n].options.painted_seeds == own + other + 16);
        CHECK(inputs[n].label == int(n) + 1);
        CHECK(inputs[n].grid == "label" + std::to_string(n + 1));
    }
}

TEST_CASE("Structures add exterior seeds and delta to the common options, and large tag distances are rejected") {
    Marks marks;
    add_points(marks, cloud({{1, 1, 1}, {5, 5, 5}}), lattice());
    marks.exterior_seeds = {{2, 2, 2}};
    marks.delta = 0.25;
    SegmentOptions options = with_voxels_of(1);
    options.exterior_seeds = {{3, 3, 3}};
    const StructureInput input = prepare_marks({marks}, lattice(), options).at(0);
    CHECK(input.options.exterior_seeds == std::vector<Vec3>{{3, 3, 3}, {2, 2, 2}});
    CHECK(input.options.evolve.delta == 0.25);
    options.evolve.delta = 0.5;
    CHECK(prepare_marks({marks}, lattice(), options).at(0).options.evolve.delta == 0.5);
    options.tag_distance = 6.9;  // the diagonal of the box of the marks is 6.93
    CHECK_NOTHROW(prepare_marks({marks}, lattice(), options));
    options.tag_distance = 7;
    CHECK_THROWS_WITH(prepare_marks({marks}, lattice(), options),
                      Catch::Contains("`tag_distance`: expected at most") && Catch::Contains(", got 7"));
}

TEST_CASE("An empty list of structures, equal names, and an empty name among several are rejected") {
    const auto prepare = [](const std::vector<Marks>& structures) {
        return prepare_marks(structures, lattice(), with_voxels_of(1));
    };
    CHECK_NOTHROW(prepare({named("a"), named("b")}));
    CHECK_THROWS_AS(prepare({named("a"), named("a")}), Error);
    CHECK_THROWS_AS(prepare({named("a"), named("")}), Error);
    CHECK_THROWS_AS(prepare({}), Error);
}
