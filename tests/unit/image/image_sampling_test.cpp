#include <catch2/catch.hpp>
#include <cmath>

#include "covol/image.h"
#include "support/ramp_image.h"

// Positions and values of images in memory.

using namespace covol;
using namespace covol::test;

TEST_CASE("Index and world coordinates are inverse maps, and the world box includes the outer voxel corners") {
    const ImageGeometry g = oblique();
    const Vec3 index{2.5, 4.0, -1.0};
    const Vec3 back = g.world_to_index(g.index_to_world(index));
    for (int a = 0; a < 3; ++a) CHECK(back[a] == Approx(index[a]));
    CHECK_FALSE(g.is_axis_aligned());
    ImageGeometry plain;
    plain.size = {4, 5, 6};
    plain.spacing = {1, 2, 3};
    plain.origin = {10, 0, 0};
    CHECK(plain.is_axis_aligned());
    CHECK(plain.world_box().min == Vec3{9.5, -1, -1.5});
    CHECK(plain.world_box().max == Vec3{13.5, 9, 16.5});
    plain.direction = {{{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}}};
    CHECK(plain.world_box().min == Vec3{6.5, -9, -1.5});
}

TEST_CASE("Samples on the image's own lattice equal its voxel values") {
    ImageGeometry g;
    g.size = {6, 5, 4};
    g.spacing = {0.35, 0.35, 0.35};
    g.origin = {1, 2, 3};
    const std::vector<std::uint8_t> values = ramp<std::uint8_t>(g);
    const Image image = Image::from_values(g, values.data());
    Domain frame;
    frame.voxel_size = 0.35000001;  // the rounding error of a spacing must not cause an interpolation
    frame.origin = g.origin;
    std::vector<float> out(2 * 3 * 4);
    image.sample(frame, {1, 1, 0}, {2, 3, 3}, out.data());
    std::size_t n = 0;
    for (int i = 1; i <= 2; ++i)
        for (int j = 1; j <= 3; ++j)
            for (int k = 0; k <= 3; ++k) CHECK(out[n++] == float(image.at(i, j, k)));
    // A position outside of the image has the value of the nearest voxel.
    float corner[1];
    image.sample(frame, {-7, -7, -7}, {-7, -7, -7}, corner);
    CHECK(corner[0] == float(image.at(0, 0, 0)));
    image.sample(frame, {70, 2, 90}, {70, 2, 90}, corner);
    CHECK(corner[0] == float(image.at(5, 2, 3)));
}

TEST_CASE("Trilinear samples of a linear function are exact for any image geometry") {
    ImageGeometry anisotropic;
    anisotropic.size = {9, 8, 7};
    anisotropic.spacing = {0.5, 0.8, 2};
    anisotropic.origin = {-3, 1, 2};
    ImageGeometry flipped = anisotropic;  // axes swapped and reversed
    flipped.direction = {{{0, 0, -1}, {1, 0, 0}, {0, -1, 0}}};
    ImageGeometry rotated = oblique();
    for (const ImageGeometry& g : {anisotropic, flipped, rotated}) {
        const auto linear = [](const Vec3& w) { return 3 + 2 * w[0] - 0.5 * w[1] + 0.25 * w[2]; };
        std::vector<float> values;
        for (int k = 0; k < g.size[2]; ++k)
            for (int j = 0; j < g.size[1]; ++j)
                for (int i = 0; i < g.size[0]; ++i)
                    values.push_back(static_cast<float>(linear(g.index_to_world({double(i), double(j), double(k)}))));
        const Image image = Image::from_values(g, values.data());
        const Domain frame = make_domain(g.world_box(), 0.23);
        std::vector<float> out(std::size_t(frame.voxel_count()));
        image.sample(frame, frame.min, frame.max, out.data());
        std::size_t n = 0;
        int inside = 0;
        double worst = 0;
        for (int i = frame.min[0]; i <= frame.max[0]; ++i)
            for (int j = frame.min[1]; j <= frame.max[1]; ++j)
                for (int k = frame.min[2]; k <= frame.max[2]; ++k, ++n) {
                    const Vec3 world = frame.index_to_world({double(i), double(j), double(k)});
                    const Vec3 index = g.world_to_index(world);
                    bool in = true;
                    for (int a = 0; a < 3; ++a) in = in && index[a] >= 0 && index[a] <= g.size[a] - 1;
                    if (!in) continue;
                    ++inside;
                    worst = std::max(worst, std::abs(out[n] - linear(world)));
                }
        CHECK(inside > 1000);
        // The tolerance is not 0, because a position within 1e-4 voxel of a centre gets the centre's value.
        CHECK(worst < 5e-4);
    }
}

TEST_CASE("Percentiles and range of a permuted ramp and of a constant image") {
    ImageGeometry g;
    g.size = {10, 10, 10};
    std::vector<float> values(1000);
    for (std::size_t n = 0; n < 1000; ++n) values[n] = static_cast<float>((n * 7) % 1000);
    const Image image = Image::from_values(g, values.data());
    CHECK(image.range() == std::array<double, 2>{0, 999});
    CHECK(image.percentiles(0, 1) == std::array<double, 2>{0, 999});
    const auto middle = image.percentiles(0.01, 0.5);
    CHECK(middle[0] == Approx(10).margin(1));
    CHECK(middle[1] == Approx(500).margin(1));
    const Image constant = Image::from_values(g, std::vector<std::uint8_t>(1000, 7).data());
    CHECK(constant.percentiles(0.01, 0.99) == std::array<double, 2>{7, 7});
}
