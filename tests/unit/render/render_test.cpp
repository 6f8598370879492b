#include "covol/render.h"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <functional>
#include <set>

#include "covol/error.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "render/draw/decorations.h"
#include "render/draw/layout.h"
#include "render/shading.h"
#include "render/slices.h"
#include "render/surface_view.h"

using namespace covol;
using figure::Color;
using figure::Rect;

namespace {

std::array<int, 3> pixel(const Picture& p, int x, int y) {
    const std::uint8_t* c = p.rgb.data() + 3 * (std::size_t(y) * p.width + x);
    return {c[0], c[1], c[2]};
}

bool is_white(const std::array<int, 3>& c) { return c[0] > 250 && c[1] > 250 && c[2] > 250; }
bool is_ink(const std::array<int, 3>& c) { return c[0] < 40 && c[1] < 40 && c[2] < 40; }
/// Orange, the colour of a single structure: much more red than blue.
bool is_warm(const std::array<int, 3>& c) { return c[0] > c[2] + 30; }

/// The number and the bounds of the pixels for which `is` is true, in a part of the picture.
struct Bounds {
    int count = 0, left = 1 << 20, right = -1, top = 1 << 20, bottom = -1;
};
Bounds find(const Picture& p, const Rect& in, const std::function<bool(const std::array<int, 3>&)>& is) {
    Bounds found;
    for (int y = in.y; y < in.bottom(); ++y)
        for (int x = in.x; x < in.right(); ++x) {
            if (!is(pixel(p, x, y))) continue;
            ++found.count;
            found.left = std::min(found.left, x);
            found.right = std::max(found.right, x);
            found.top = std::min(found.top, y);
            found.bottom = std::max(found.bottom, y);
        }
    return found;
}

FloatGridPtr make_ball(const Vec3& center, double radius, double h) {
    const double r = radius + 5 * h;
    const WorldBox box{{center[0] - r, center[1] - r, center[2] - r}, {center[0] + r, center[1] + r, center[2] + r}};
    return extract_surface(*start_from_sphere(make_domain(box, h), center, radius));
}

RenderStructure structure(const FloatGridPtr& surface, const std::string& name = "surface") {
    RenderStructure s;
    s.name = name;
    s.surface = surface.get();
    return s;
}

/// An image whose voxels have the values value(world position).
Image make_image(const ImageGeometry& geometry, const std::function<float(const Vec3&)>& value) {
    std::vector<float> values;
    for (int k = 0; k < geometry.size[2]; ++k)
        for (int j = 0; j < geometry.size[1]; ++j)
            for (int i = 0; i < geometry.size[0]; ++i)
                values.push_back(value(geometry.index_to_world({double(i), double(j), double(k)})));
    return Image::from_values(geometry, values.data());
}

RenderOptions sized(int width, int height, FigureKind kind) {
    RenderOptions options;
    options.width = width;
    options.height = height;
    options.figure = kind;
    return options;
}

}  // namespace

TEST_CASE("A coarse ball is shaded like an exact sphere, without visible voxels") {
    // The radius is ten voxels. If normals were constant in each voxel, they would be off by up to 0.05 rad, and the
    // shading by 0.03.
    const double h = 0.1, radius = 1 - h * h / 3;  // radius of the smoothed field
    const FloatGridPtr ball = make_ball({0.03, -0.02, 0.01}, 1, h);
    figure::Camera camera;
    camera.basis = figure::view_basis(-32, 28);
    camera.center = {0.03, -0.02, 0.01};
    camera.pixel = 0.01;
    camera.at = {0, 0, 240, 240};
    const Color base{0.8F, 0.5F, 0.2F};
    const figure::Layer layer = figure::cast_surfaces({{ball.get(), base, 1}}, camera, {});
    const auto unit = [](const Vec3& v) { return Vec3{v[0] / length(v), v[1] / length(v), v[2] / length(v)}; };
    // The directions of the lights, in the camera's axes: right, up, towards the eye.
    const Vec3 key = unit({-0.55, 0.75, 1}), fill = unit({1, -0.1, 0.7}), half = unit({key[0], key[1], key[2] + 1});
    const auto dot = [](const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    double worst = 0, off_disc = 0;
    int lit = 0;
    for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 240; ++x) {
            const double u = (x - 119.5) * 0.01 / radius, v = (119.5 - y) * 0.01 / radius, r = std::hypot(u, v);
            const std::size_t n = std::size_t(y) * 240 + x;
            const double covered = std::clamp((1 - r) * radius / 0.01 + 0.5, 0.0, 1.0);
            off_disc = std::max(off_disc, std::abs(layer.fraction[n] - covered));
            if (r > 0.97) continue;
            const Vec3 normal{u, v, std::sqrt(1 - r * r)};
            const double light =
                0.34 + 0.64 * std::max(0.0, dot(normal, key)) + 0.16 * std::max(0.0, dot(normal, fill));
            const double shine = 0.10 * std::pow(std::max(0.0, dot(normal, half)), 30);
            const double rim = 1 - 0.25 * std::pow(1 - normal[2], 3);
            for (int c = 0; c < 3; ++c)
                worst = std::max(worst, std::abs(layer.color[n][c] - (base[c] * light * rim + shine)));
            ++lit;
        }
    CHECK(lit > 25000);
    CHECK(worst < 0.008);
    CHECK(off_disc < 0.35);  // pixels by which the outline differs from a circle
}

TEST_CASE("A scale bar has a round length, and its label states that length") {
    figure::Canvas canvas(300, 100, figure::gray(1));
    // The bar may take 0.32 of 250 pixels of 0.5 um, that is 40 um. The next smaller round length is 20 um, 40 pixels.
    figure::draw_scale_bar(canvas, 280, 90, 250, 0.5, "um", {figure::gray(0), 14, 0});
    const Bounds bar = find(canvas.picture(), {0, 88, 300, 2}, is_ink);
    CHECK(bar.right == 279);
    CHECK(bar.right - bar.left + 1 == 40);
    CHECK(figure::length_text(20, "um") == "20 µm");
    CHECK(figure::length_text(0.5, "mm") == "0.5 mm");
    CHECK(figure::length_text(20, "") == "20 units");
    CHECK(figure::round_length(40) == 20);
    CHECK(figure::round_length(0.0999999) == Approx(0.05));
    CHECK(figure::round_length(1000) == 1000);
    CHECK(figure::short_number(75.95) == "76");
    CHECK(figure::short_number(-0.25) == "−0.25");
    CHECK(figure::short_number(1234.5) == "1234");
}

TEST_CASE("In a figure, the scale bar has the scale of the surface") {
    const FloatGridPtr ball = make_ball({100, 50, 20}, 5, 0.5);
    RenderScene scene;
    scene.structures = {structure(ball)};
    const Picture picture = render(scene, sized(600, 400, FigureKind::Surface));
    const Bounds disc = find(picture, {120, 0, 360, 365}, [](const auto& c) { return !is_white(c); });
    const double pixel = 10.0 / (disc.right - disc.left + 1);
    CHECK(std::abs((disc.right - disc.left) - (disc.bottom - disc.top)) <= 2);
    const Bounds bar = find(picture, {300, 391, 300, 1}, is_ink);
    const double shown = (bar.right - bar.left + 1) * pixel;
    CHECK(shown == Approx(figure::round_length(shown * 1.02)).epsilon(0.02));
}

TEST_CASE("Outlines lie on the circle in which a plane cuts a ball, also with anisotropic voxels") {
    const double radius = 10;
    const Vec3 center{15, 14, 16};
    const FloatGridPtr ball = make_ball(center, radius, 0.5);
    ImageGeometry geometry;
    geometry.size = {31, 31, 10};
    geometry.spacing = {1, 1, 3.5};
    const Image image = make_image(geometry, [](const Vec3&) { return 0.0F; });
    RenderScene scene;
    scene.structures = {structure(ball)};
    scene.image = &image;
    for (const int axis : {0, 1, 2}) {
        const figure::Plane plane = figure::plane_across(axis, axis == 2 ? 4 : 15, scene);
        const figure::Region region = figure::region_around({{{5, 4, 6}, {25, 24, 26}}}, geometry, 0.1);
        figure::SliceStyle style;
        style.pixel = 0.1;
        style.text = 10;
        const int width = int(region.length(plane.across, geometry) / 0.1);
        const int height = int(region.length(plane.down, geometry) / 0.1);
        figure::Canvas canvas(width, height, figure::gray(0));
        figure::draw_slice(canvas, canvas.whole(), plane, region, scene, style, {});
        const Picture picture = canvas.picture();
        const Vec3 middle = geometry.world_to_index(center);
        const auto [x0, y0] = figure::place_on(canvas.whole(), plane, region, 0.1, middle, geometry);
        Vec3 cut = middle;
        cut[axis] = plane.index;
        const double plane_offset = (cut[axis] - middle[axis]) * geometry.spacing[axis];
        const double expected = std::sqrt(radius * radius - plane_offset * plane_offset) / 0.1;
        double sum = 0, worst = 0;
        int count = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                if (!is_warm(pixel(picture, x, y))) continue;
                const double r = std::hypot(x + 0.5 - x0, y + 0.5 - y0);
                sum += r;
                worst = std::max(worst, std::abs(r - expected));
                ++count;
            }
        INFO("axis " << axis);
        CHECK(count > 1000);
        CHECK(sum / count == Approx(expected).margin(0.5));
        CHECK(worst < 3);
    }
}

TEST_CASE("Anatomical slices have radiological orientation and the matching letters") {
    // The first index runs to the right of the patient, the second to the back, the third to the head.
    ImageGeometry geometry;
    geometry.size = {20, 24, 16};
    geometry.direction = {{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    geometry.origin = {19, 0, 0};
    const Vec3 left_place{15, 12, 8};  // a position left of the patient's midline
    const Image image = make_image(geometry, [&](const Vec3& at) {
        return std::abs(at[0] - left_place[0]) + std::abs(at[1] - left_place[1]) < 2 ? 200.0F : 0.0F;
    });
    RenderScene scene;
    const FloatGridPtr ball = make_ball({9.5, 12, 8}, 6, 1);
    scene.structures = {structure(ball)};
    scene.image = &image;
    scene.is_anatomical = true;
    const figure::Region region{{-0.5, -0.5, -0.5}, {19.5, 23.5, 15.5}};
    const auto place = [&](const figure::Plane& plane, const Vec3& world) {
        return figure::place_on({0, 0, 100, 100}, plane, region, 1, geometry.world_to_index(world), geometry);
    };
    const figure::Plane axial = figure::plane_across(2, 8, scene), coronal = figure::plane_across(1, 12, scene);
    const figure::Plane sagittal = figure::plane_across(0, 9, scene);
    CHECK(place(axial, {15, 12, 8})[0] > place(axial, {5, 12, 8})[0]);        // the patient's left is on the right
    CHECK(place(axial, {10, 20, 8})[1] > place(axial, {10, 5, 8})[1]);        // the back is at the bottom
    CHECK(place(coronal, {15, 12, 8})[0] > place(coronal, {5, 12, 8})[0]);    // the patient's left is on the right
    CHECK(place(coronal, {10, 12, 12})[1] < place(coronal, {10, 12, 3})[1]);  // the head is at the top
    CHECK(place(sagittal, {10, 20, 8})[0] > place(sagittal, {10, 5, 8})[0]);  // the back is on the right
    CHECK(figure::letters_of(0, geometry) == std::array<std::string, 2>{"R", "L"});
    CHECK(figure::letters_of(1, geometry) == std::array<std::string, 2>{"P", "A"});
    CHECK(figure::letters_of(2, geometry) == std::array<std::string, 2>{"S", "I"});
    CHECK(figure::name_of(axial, scene) == "axial slice 8, z = 8");

    figure::Canvas canvas(200, 240, figure::gray(0));
    figure::SliceStyle style;
    style.pixel = 0.1;
    style.text = 18;
    style.window = {0, 200};
    figure::draw_slice(canvas, canvas.whole(), axial, region, scene, style, {});
    const Picture picture = canvas.picture();
    const auto bright = [](const std::array<int, 3>& c) { return c[0] > 200 && c[2] > 200; };
    // The bright block is on the right. Beside the letters the picture is dark; an L has ink at its foot, an R also at
    // its top right.
    CHECK(find(picture, {135, 115, 40, 20}, bright).count > 150);
    CHECK(find(picture, {25, 115, 40, 20}, bright).count == 0);
    const Bounds r = find(picture, {0, 105, 24, 30}, bright), l = find(picture, {178, 105, 22, 30}, bright);
    REQUIRE(r.count > 20);
    REQUIRE(l.count > 15);
    const auto top_right = [&](const Bounds& b) {
        return find(picture, {(b.left + b.right + 1) / 2, b.top, (b.right - b.left) / 2, 6}, bright).count;
    };
    CHECK(top_right(r) > 3);
    CHECK(top_right(l) == 0);
}

TEST_CASE("Slices with marks are found and preferred for figures") {
    ImageGeometry geometry;
    geometry.size = {100, 80, 30};
    geometry.spacing = {1, 1, 3};
    std::vector<Vec3> marks;
    for (const int slice : {4, 9, 15, 22})
        for (int n = 0; n < 12; ++n)
            marks.push_back({50 + 30 * std::cos(0.5 * n), 40 + 20 * std::sin(0.5 * n), 3.0 * slice});
    const figure::MarkedSlices marked = figure::find_marked_slices(marks, geometry);
    CHECK(marked.axis == 2);
    CHECK(marked.slices == std::vector<int>{4, 9, 15, 22});
    const std::vector<WorldBox> boxes{{{20, 20, 3}, {80, 60, 75}}};
    CHECK(figure::middle_slice(2, boxes, marked, geometry) == 15);
    CHECK(figure::spread_slices(2, 3, boxes, marked, geometry) == std::vector<int>{9, 15, 22});
    CHECK(figure::spread_slices(2, 3, boxes, {}, geometry) == std::vector<int>{7, 13, 19});
    CHECK(figure::middle_slice(0, boxes, marked, geometry) == 50);
    // If two structures have only a few slices in common, one of these is chosen: both meet z = 33 to 42.
    const std::vector<WorldBox> two{{{0, 0, 0}, {10, 10, 42}}, {{0, 0, 33}, {10, 10, 87}}};
    const int both = figure::middle_slice(2, two, {}, geometry);
    CHECK(both >= 13);
    CHECK(both <= 14);
    // The marks of a cloud lie on no slices.
    for (std::size_t n = 0; n < marks.size(); ++n) marks[n][2] += 0.37 * double(n % 7);
    CHECK(figure::find_marked_slices(marks, geometry).axis == -1);
}

TEST_CASE("Structures have their own colours, and a structure around another one is transparent by default") {
    const FloatGridPtr a = make_ball({-6, 0, 0}, 4, 0.4), b = make_ball({6, 0, 0}, 4, 0.4);
    RenderScene scene;
    scene.structures = {structure(a, "one"), structure(b, "two")};
    scene.structures[0].color = {40, 60, 220};
    scene.structures[1].color = {220, 60, 40};
    RenderOptions options = sized(400, 260, FigureKind::Surface);
    options.view = {0, 0};
    Picture picture = render(scene, options);
    const auto blue = [](const std::array<int, 3>& c) { return c[2] > c[0] + 60; };
    const auto red = [](const std::array<int, 3>& c) { return c[0] > c[2] + 60; };
    const Rect below_legend{0, 60, 400, 150};
    CHECK(find(picture, below_legend, blue).right < 200);
    CHECK(find(picture, below_legend, red).left >= 200);
    CHECK(find(picture, below_legend, blue).count > 8000);
    CHECK(find(picture, {0, 0, 30, 50}, blue).count > 20);  // the patches of colour in the legend
    CHECK(find(picture, {0, 0, 30, 50}, red).count > 20);

    const FloatGridPtr around = make_ball({0, 0, 0}, 12, 0.6), inner = make_ball({0, 0, 0}, 4, 0.4);
    scene.structures[0].surface = around.get();
    scene.structures[1].surface = inner.get();
    picture = render(scene, options);
    const std::array<int, 3> veiled = pixel(picture, 200, 115);
    CHECK(veiled[0] > veiled[2] + 30);
    scene.structures[0].opacity = 1;
    picture = render(scene, options);
    CHECK(blue(pixel(picture, 200, 115)));
    scene.structures[0].opacity = 1.5;
    CHECK_THROWS_AS(render(scene, options), Error);
}

TEST_CASE("Frames of a rotation differ and have the same scale") {
    const FloatGridPtr a = make_ball({-8, 0, 0}, 3, 0.5), b = make_ball({5, 2, 3}, 4, 0.5);
    RenderScene scene;
    scene.structures = {structure(a, "one"), structure(b, "two")};
    RenderOptions options = sized(300, 240, FigureKind::Surface);
    options.whole_turn = true;
    std::set<std::vector<std::uint8_t>> frames;
    std::set<std::vector<std::uint8_t>> bars;
    for (const double azimuth : {0.0, 90.0, 180.0, 270.0}) {
        options.view = {azimuth, 20};
        const Picture picture = render(scene, options);
        frames.insert(picture.rgb);
        std::vector<std::uint8_t> bar;
        for (int y = 226; y < 240; ++y)
            for (int x = 150; x < 300; ++x)
                for (const int c : pixel(picture, x, y)) bar.push_back(std::uint8_t(c));
        bars.insert(bar);
        // Neither the surface nor the bar reaches the edge of the picture.
        for (int x = 0; x < 300; ++x) CHECK(is_white(pixel(picture, x, 2)));
        for (int y = 60; y < 180; ++y) CHECK((is_white(pixel(picture, 1, y)) && is_white(pixel(picture, 298, y))));
    }
    CHECK(frames.size() == 4);
    CHECK(bars.size() == 1);
}

TEST_CASE("A slice shows the marks within half a voxel along its own axis, however thick the voxels are along others") {
    ImageGeometry geometry;
    geometry.size = {20, 20, 6};
    geometry.spacing = {1, 1, 5};
    const Image image = make_image(geometry, [](const Vec3&) { return 0.0F; });
    RenderScene scene;
    scene.image = &image;
    const auto is_drawn = [&](int axis, double index, const Vec3& mark) {
        scene.marks = {mark};
        const figure::Plane plane = figure::plane_across(axis, index, scene);
        const figure::Region region{{-0.5, -0.5, -0.5}, {19.5, 19.5, 5.5}};
        const Rect at{0, 0, 200, 200};
        figure::SliceStyle style;
        style.pixel = 0.25;
        figure::Canvas canvas(at.width, at.height, figure::gray(0));
        figure::draw_slice(canvas, at, plane, region, scene, style, {});
        const auto [x, y] = figure::place_on(at, plane, region, style.pixel, geometry.world_to_index(mark), geometry);
        const std::array<int, 3> color = pixel(canvas.picture(), int(x), int(y));
        return color[2] > color[0] + 80;
    };
    for (const int axis : {0, 1})
        for (const auto& [off, expected] :
             {std::pair{0.0, true}, {0.45, true}, {-0.45, true}, {0.6, false}, {-2.0, false}}) {
            INFO("axis " << axis << ", " << off << " voxels");
            Vec3 mark{10, 10, 10};
            mark[axis] += off;
            CHECK(is_drawn(axis, 10, mark) == expected);
        }
    CHECK(is_drawn(2, 2, {10, 10, 12.4}));
    CHECK_FALSE(is_drawn(2, 2, {10, 10, 12.6}));
}

TEST_CASE("A composed figure has no empty quarter, shows marks, and is identical for any number of threads") {
    const Vec3 center{20, 18, 22};
    const FloatGridPtr ball = make_ball(center, 9, 1);
    ImageGeometry geometry;
    geometry.size = {40, 36, 12};
    geometry.spacing = {1, 1, 4};
    geometry.unit = "um";
    const Image image = make_image(geometry, [&](const Vec3& at) {
        return std::abs(length({at[0] - center[0], at[1] - center[1], at[2] - center[2]}) - 9) < 2 ? 200.0F : 20.0F;
    });
    RenderScene scene;
    scene.structures = {structure(ball)};
    for (int n = 0; n < 12; ++n)
        scene.structures[0].marks.push_back({20 + 8.8 * std::cos(n), 18 + 8.8 * std::sin(n), 24});
    scene.image = &image;
    scene.unit = "um";
    RenderOptions options = sized(600, 400, FigureKind::Composed);
    const Picture picture = render(scene, options);
    // No quarter of the picture is empty.
    for (const Rect& part :
         {Rect{0, 0, 300, 200}, Rect{300, 0, 300, 200}, Rect{0, 200, 300, 200}, Rect{300, 200, 300, 200}})
        CHECK(find(picture, part, [](const auto& c) { return !is_white(c); }).count > 300 * 200 / 8);
    const auto mark = [](const std::array<int, 3>& c) { return c[2] > c[0] + 80; };
    CHECK(find(picture, {0, 0, 600, 400}, mark).count > 12 * 8);
    for (const int threads : {1, 2, 8}) {
        RunContext run;
        run.threads = threads;
        CHECK(render(scene, options, run).rgb == picture.rgb);
    }
    // The image is shown behind the surface only if it was requested.
    options.figure = FigureKind::Surface;
    const Picture bare = render(scene, options);
    options.volume = true;
    CHECK(render(scene, options).rgb != bare.rgb);
    options.volume = false;
    options.white_background = false;
    CHECK(is_ink(pixel(render(scene, options), 300, 1)));
}

TEST_CASE("Layouts preserve proportions and do not overlap") {
    const std::vector<figure::Tiling> ways = figure::ways_for_three({{{40, 30}, {12, 30}, {40, 12}}});
    for (const double aspect : {0.5, 1.0, 2.5}) {
        const figure::Split found = figure::split({10, 10, 600, 400}, aspect, 30, ways, 6);
        std::vector<Rect> all = found.parts.at;
        REQUIRE(all.size() == 3);
        CHECK(double(all[0].width) / all[0].height == Approx(40.0 / 30).epsilon(0.02));
        all.push_back(found.view);
        for (std::size_t a = 0; a < all.size(); ++a) {
            CHECK((all[a].x >= 10 && all[a].y >= 10 && all[a].right() <= 610 && all[a].bottom() <= 410));
            for (std::size_t b = 0; b < a; ++b)
                CHECK((all[a].right() <= all[b].x || all[b].right() <= all[a].x || all[a].bottom() <= all[b].y ||
                       all[b].bottom() <= all[a].y));
        }
        CHECK(found.view.width * found.view.height > 600 * 400 / 4);
    }
}

TEST_CASE("Text is drawn at its position, and missing characters are drawn as a replacement") {
    figure::Canvas canvas(120, 40, figure::gray(1));
    figure::draw_text(canvas, 100, 30, "HH", {20, figure::gray(0), figure::Align::Right, 0, {}});
    const Bounds ink = find(canvas.picture(), canvas.whole(), is_ink);
    CHECK(ink.bottom == 29);
    CHECK(ink.bottom - ink.top + 1 == Approx(figure::kCapHeight * 20).margin(1));
    CHECK(ink.right < 100);
    CHECK(ink.left > 100 - figure::text_width("HH", 20));
    CHECK(figure::text_width("HH", 20) == Approx(2 * figure::text_width("H", 20)));
    CHECK(figure::text_width("\xc3\xa9", 20) == Approx(figure::text_width("e", 20)).epsilon(0.05));
    // Characters that the font lacks, and invalid UTF-8, are drawn as the same replacement.
    CHECK(figure::text_width("\xe4\xb8\xad", 20) == figure::text_width("\xff", 20));
}

TEST_CASE("Views are parsed by name and by angles, and invalid ones are rejected") {
    CHECK(parse_view("right", false).azimuth == 90);
    CHECK(parse_view("left", true).azimuth == 90);  // for patients, the left is in the direction +x
    CHECK(parse_view("-30,45.5", false).elevation == 45.5);
    for (const char* bad : {"", "behind", "1", "1,", ",1", "1,2,3", "1,95", "nan,0", "1e999,0"})
        CHECK_THROWS_AS(parse_view(bad, false), Error);
    const figure::Basis front = figure::view_basis(0, 0), top = figure::view_basis(0, 90),
                        right = figure::view_basis(90, 0);
    CHECK(front.right[0] == Approx(1));
    CHECK(front.up[2] == Approx(1));
    CHECK(top.up[1] == Approx(1));
    CHECK(top.to_eye[2] == Approx(1));
    CHECK(right.to_eye[0] == Approx(1));
    CHECK(right.right[1] == Approx(1));
}

TEST_CASE("Invalid render options and scenes are rejected, and pictures are written as PNG") {
    RenderOptions options;
    options.width = 1;
    options.zoom = 0;
    CHECK(why_invalid(options).find("width") != std::string::npos);
    CHECK(why_invalid(options).find("zoom") != std::string::npos);
    options = sized(16384, 16384, FigureKind::Surface);
    CHECK(why_invalid(options).find("50 million") != std::string::npos);
    CHECK_THROWS_AS(render(RenderScene{}), Error);
    const FloatGridPtr ball = make_ball({0, 0, 0}, 1, 0.2);
    RenderScene scene;
    scene.structures = {structure(ball)};
    CHECK_THROWS_AS(render(scene, sized(100, 100, FigureKind::Slices)), Error);
    RunContext small;
    small.memory_budget = 100'000;
    CHECK_THROWS_AS(render(scene, sized(100, 100, FigureKind::Surface), small), Error);
    const std::string path = (std::filesystem::temp_directory_path() / "covol_render_test.png").string();
    write_png(path, Picture{2, 1, {255, 0, 0, 0, 255, 0}});
    CHECK(std::filesystem::file_size(path) > 8);
    std::filesystem::remove(path);
    CHECK_THROWS_AS(write_png("/no/such/folder/x.png", Picture{1, 1, {0, 0, 0}}), Error);
}
