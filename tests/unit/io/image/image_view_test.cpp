#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "covol/error.h"
#include "covol/image.h"
#include "covol/point_array.h"
#include "support/scratch.h"

namespace covol {
namespace {

ImageGeometry lattice(const Index3& size) {
    ImageGeometry geometry;
    geometry.size = size;
    geometry.spacing = {0.5, 1.0, 2.0};
    geometry.origin = {3.0, -4.0, 5.0};
    return geometry;
}

/// Voxel (i,j,k) has the value i + 10 j + 100 k and lies at the offset given by `stride`.
std::shared_ptr<const void> fill(std::vector<float>& memory, const Index3& size,
                                 const std::array<std::int64_t, 3>& stride, std::int64_t first) {
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i)
                memory[std::size_t(first + stride[0] * i + stride[1] * j + stride[2] * k)] =
                    static_cast<float>(i + 10 * j + 100 * k);
    return {memory.data() + first, [](const void*) {}};
}

}  // namespace

TEST_CASE("An image view with any strides has the values, statistics and samples of a dense image") {
    const Index3 size{4, 3, 5};
    std::vector<float> dense(60);
    fill(dense, size, {1, 4, 12}, 0);
    const Image expected = Image::from_values(lattice(size), dense.data());
    struct Layout {
        std::array<std::int64_t, 3> stride;
        std::int64_t first;
    };
    for (const Layout& layout : {Layout{{1, 4, 12}, 0}, Layout{{15, 5, 1}, 0}, Layout{{-1, -4, -12}, 59},
                                 Layout{{2, 16, 96}, 7}, Layout{{-30, 10, -2}, 200}}) {
        std::vector<float> memory(600, std::numeric_limits<float>::quiet_NaN());
        const auto first = fill(memory, size, layout.stride, layout.first);
        const Image image = Image::from_view(lattice(size), {PixelType::Float, first, layout.stride});
        for (int k = 0; k < 5; ++k)
            for (int j = 0; j < 3; ++j)
                for (int i = 0; i < 4; ++i) REQUIRE(image.at(i, j, k) == i + 10 * j + 100 * k);
        CHECK(image.range() == expected.range());
        CHECK(image.percentiles(0.1, 0.7) == expected.percentiles(0.1, 0.7));
        const Domain frame{0.8, {3.1, -4.2, 5.3}, {0, 0, 0}, {3, 3, 3}};
        std::vector<float> view_samples(64), dense_samples(64);
        image.sample(frame, frame.min, frame.max, view_samples.data());
        expected.sample(frame, frame.min, frame.max, dense_samples.data());
        CHECK(view_samples == dense_samples);
        REQUIRE(image.view());
        CHECK(image.view()->first.get() == first.get());  // the image uses the given memory, and nothing was copied
        CHECK(image.view()->stride == layout.stride);
    }
    CHECK(expected.view()->type == PixelType::Float);
}

TEST_CASE("A view keeps its memory alive as long as any image of it exists") {
    auto memory = std::make_shared<std::vector<float>>(60, 7.0F);
    const std::weak_ptr<std::vector<float>> watched = memory;
    auto image = std::make_unique<Image>(
        Image::from_view(lattice({4, 3, 5}), {PixelType::Float, {memory, memory->data()}, {1, 4, 12}}));
    memory.reset();
    const Image part = image->cropped();
    image.reset();
    CHECK(!watched.expired());
    CHECK(part.at(3, 2, 4) == 7);
}

TEST_CASE("An invalid image view is rejected with the name of the wrong field") {
    std::vector<float> memory(60, 1.0F);
    const VoxelView view{PixelType::Float, {memory.data(), [](const void*) {}}, {1, 4, 12}};
    const auto refuse = [&](const ImageGeometry& geometry, const char* field) {
        CHECK_THROWS_WITH(Image::from_view(geometry, view), Catch::Matchers::Contains(field));
    };
    ImageGeometry geometry = lattice({4, 3, 5});
    geometry.spacing[1] = 0;
    refuse(geometry, "spacing: expected");
    geometry = lattice({4, 3, 5});
    geometry.origin[2] = std::nan("");
    refuse(geometry, "origin: expected");
    geometry = lattice({4, 3, 5});
    geometry.direction[0][1] = 1;
    refuse(geometry, "direction: expected");
    refuse(lattice({4, 3, 1}), "two voxels");
    memory[59] = std::numeric_limits<float>::infinity();
    refuse(lattice({4, 3, 5}), "voxel (3, 2, 4)");
}

TEST_CASE("Positions in memory are interpreted like those in a file, for all spaces and axis orders") {
    const std::vector<Vec3> given{{1, 2, 3}, {4, 5, 6.5}};
    const Scratch scratch;
    const std::string path = scratch.path("points.xyz");
    write_points(path, given);
    for (const PointSpace space : {PointSpace::Unstated, PointSpace::World, PointSpace::Ras, PointSpace::Index,
                                   PointSpace::IndexOne, PointSpace::Local})
        for (const PointOrder order : {PointOrder::Unstated, PointOrder::XYZ, PointOrder::ZYX}) {
            ReadPointsOptions reading;
            reading.space = space;
            reading.order = order;
            reading.scale = 0.5;
            const PointCloud cloud = make_cloud(given, reading), file = read_points(path, reading);
            CHECK(cloud.points == file.points);
            CHECK(cloud.space == file.space);
            CHECK(cloud.stated == file.stated);
        }
}

}  // namespace covol
