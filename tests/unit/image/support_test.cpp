#include "image/support.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

using namespace covol;
using detail::BorderKind;
using detail::find_strongest_border;
using detail::StrongestBorder;

namespace {

/// An image of 48^3 voxels of edge 0.5, with the values value(x), x in voxels, plus noise.
Image slab(const std::function<double(double)>& value, double noise = 0.05) {
    ImageGeometry geometry;
    geometry.size = {48, 48, 48};
    geometry.spacing = {0.5, 0.5, 0.5};
    std::mt19937 random(7);
    std::normal_distribution<float> distribution(0, float(noise));
    std::vector<float> values;
    for (int k = 0; k < 48; ++k)
        for (int j = 0; j < 48; ++j)
            for (int i = 0; i < 48; ++i) values.push_back(float(value(i)) + distribution(random));
    return Image::from_values(geometry, values.data());
}

/// The strongest border for 60 marks in the plane x = `x_voxels`, whose normals are (`normal`, 0, 0).
StrongestBorder border_at(const Image& image, double x_voxels, double normal = 1, BorderKind kind = BorderKind::Slope) {
    std::vector<Vec3> places, normals;
    for (int n = 0; n < 60; ++n) {
        places.push_back({0.5 * x_voxels, 2 + 0.31 * n, 3 + 0.17 * n});
        normals.push_back({normal, 0, 0});
    }
    return find_strongest_border(image, places, normals, 0.5, kind, {});
}

}  // namespace

TEST_CASE("Marks within a voxel of a border: the steepest slope is found at the marks") {
    const Image image = slab([](double x) { return x > 20.3 ? 1 : 0; });
    for (const double off : {-0.7, 0.0, 0.6}) {
        CAPTURE(off);
        const StrongestBorder found = border_at(image, 20.5 + off);
        CHECK(found.lines == 60);
        CHECK(std::abs(found.at) <= 1);
        CHECK(found.fraction == 1);
    }
}

TEST_CASE("Marks 6 voxels beside a border: it is found 6 voxels away along the normals, for either sign") {
    for (const double sign : {1.0, -1.0}) {
        const Image image = slab([&](double x) { return x > 20.5 ? sign : 0; });
        const StrongestBorder behind = border_at(image, 26.5), before = border_at(image, 26.5, -1);
        CHECK(std::abs(behind.at + 6) <= 1);
        CHECK(std::abs(before.at - 6) <= 1);
        for (const StrongestBorder& found : {behind, before}) {
            CHECK(found.fraction < 0.2);
            CHECK(found.errors > 10);
        }
    }
}

TEST_CASE("The steeper of two borders is found, with the relative steepness of the border at the marks") {
    const Image image = slab([](double x) { return (x > 20.5 ? 1.0 : 0.0) + (x > 27.5 ? 4.0 : 0.0); });
    const StrongestBorder found = border_at(image, 20.5);
    CHECK(std::abs(found.at - 7) <= 1);
    CHECK(found.fraction == Approx(0.25).margin(0.03));
    CHECK(border_at(image, 27.5).fraction == 1);
}

TEST_CASE("Marks at the centre of a line have full strength if judged as a line, but not as a slope") {
    for (const double sign : {1.0, -1.0}) {
        const Image image = slab([&](double x) { return sign * std::exp(-(x - 22) * (x - 22) / 18); });
        CHECK(border_at(image, 22).fraction < 0.7);  // if the line is judged as a slope
        CHECK(border_at(image, 22, 1, BorderKind::Line).fraction == 1);
        const StrongestBorder beside = border_at(image, 28, 1, BorderKind::Line);
        CHECK(std::abs(beside.at + 6) <= 1);
        CHECK(beside.fraction < 0.5);
        CHECK(beside.errors > 4);  // clearly more than chance
    }
}

TEST_CASE("In pure noise no significantly steeper border is found") {
    const Image image = slab([](double) { return 0; }, 1);
    CHECK(border_at(image, 24).errors < 4);
}

TEST_CASE("Profile lines outside the image are not counted, and without any line the fraction is 1") {
    const Image image = slab([](double x) { return x > 3.5 ? 1 : 0; });
    CHECK(border_at(image, 3.5).fraction == 1);
    const StrongestBorder none = border_at(image, 500);
    CHECK(none.lines == 0);
    CHECK(none.fraction == 1);
    CHECK(find_strongest_border(image, {}, {}, 0.5, BorderKind::Slope, {}).lines == 0);
}
