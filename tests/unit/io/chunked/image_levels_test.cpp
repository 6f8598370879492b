#include "covol/image_levels.h"

#include <tbb/parallel_for.h>
#include <zlib.h>

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "covol/error.h"
#include "covol/page_data.h"
#include "io/pixels/chunk_cache.h"

using namespace covol;
using detail::ChunkCache;
using detail::ChunkSource;

namespace {

/// A source whose voxel (i,j,k) is i + 3 j + 7 k, times `scale`. The chunk at the origin may be missing.
class Slope final : public ChunkSource {
public:
    Slope(const Index3& size, int chunk, int scale, bool lacks_first = false)
        : ChunkSource("slope", PixelType::UInt16, size, {chunk, chunk, chunk}), scale_(scale), lacks_(lacks_first) {}
    [[nodiscard]] bool read(const Index3& chunk, void* out) const override {
        ++reads;
        if (lacks_ && chunk == Index3{0, 0, 0}) return false;
        auto* values = static_cast<std::uint16_t*>(out);
        const Index3& n = chunk_size();
        for (int k = 0; k < n[2]; ++k)
            for (int j = 0; j < n[1]; ++j)
                for (int i = 0; i < n[0]; ++i)
                    *values++ = std::uint16_t(
                        scale_ * (chunk[0] * n[0] + i + 3 * (chunk[1] * n[1] + j) + 7 * (chunk[2] * n[2] + k)));
        return true;
    }
    mutable std::atomic<int> reads{0};

private:
    int scale_;
    bool lacks_;
};

constexpr std::uint64_t kChunkBytes = 8 * 8 * 8 * 2;

ImageGeometry geometry_of(const Index3& size, const Vec3& spacing) {
    ImageGeometry geometry;
    geometry.size = size;
    geometry.spacing = spacing;
    return geometry;
}

/// An image in three levels, whose voxels are 1, 2 and 4 times as wide; in the last level only twice as wide along k.
struct Pyramid {
    Index3 size{40, 24, 36};
    std::shared_ptr<Slope> fine = std::make_shared<Slope>(size, 8, 1);
    std::shared_ptr<Slope> half = std::make_shared<Slope>(Index3{20, 12, 18}, 8, 2);
    std::shared_ptr<Slope> quarter = std::make_shared<Slope>(Index3{10, 6, 18}, 8, 4);
    std::vector<ImageLevels::Source> sources{{geometry_of(size, {0.5, 0.5, 0.5}), fine},
                                             {geometry_of({20, 12, 18}, {1, 1, 1}), half},
                                             {geometry_of({10, 6, 18}, {2, 2, 1}), quarter}};

    [[nodiscard]] ImageLevels open(std::uint64_t max_bytes = 1 << 20) const {
        const std::vector<float> zeros(detail::voxel_count(size));
        return {Image::from_values(sources.front().geometry, zeros.data()), sources, max_bytes};
    }
};

std::vector<int> unpacked(const PageSlice& slice) {
    std::vector<unsigned char> bytes(2 * std::size_t(slice.width) * std::size_t(slice.height));
    uLongf count = bytes.size();
    REQUIRE(uncompress(bytes.data(), &count, reinterpret_cast<const Bytef*>(slice.bytes.data()), slice.bytes.size()) ==
            Z_OK);
    REQUIRE(count == bytes.size());
    std::vector<int> values;
    for (std::size_t n = 0; n < bytes.size(); n += 2) values.push_back(bytes[n] + 256 * bytes[n + 1]);
    return values;
}

}  // namespace

TEST_CASE("Chunk cache: the chunks that were used last are kept, up to the limit in bytes") {
    const Slope source({64, 8, 8}, 8, 1);
    ChunkCache cache(3 * kChunkBytes);
    for (int n = 0; n < 3; ++n) static_cast<void>(cache.get(source, {n, 0, 0}));
    static_cast<void>(cache.get(source, {0, 0, 0}));  // chunk 1 is now the least recently used
    CHECK(source.reads == 3);
    CHECK(cache.bytes() == 3 * kChunkBytes);
    const ChunkCache::Chunk held = cache.get(source, {1, 0, 0});
    static_cast<void>(cache.get(source, {3, 0, 0}));
    static_cast<void>(cache.get(source, {4, 0, 0}));
    static_cast<void>(cache.get(source, {5, 0, 0}));
    CHECK(cache.bytes() == 3 * kChunkBytes);
    CHECK(cache.decoded() == 6);
    CHECK(reinterpret_cast<const std::uint16_t*>(held.get())[0] == 8);  // a chunk in use stays valid
    static_cast<void>(cache.get(source, {5, 0, 0}));
    CHECK(source.reads == 6);
    static_cast<void>(cache.get(source, {1, 0, 0}));
    CHECK(source.reads == 7);
}

TEST_CASE("Chunk cache: a missing chunk is 0 and does not count towards the limit") {
    const Slope source({16, 8, 8}, 8, 1, true);
    ChunkCache cache(kChunkBytes);
    const ChunkCache::Chunk none = cache.get(source, {0, 0, 0});
    CHECK(reinterpret_cast<const std::uint16_t*>(none.get())[5] == 0);
    CHECK(cache.bytes() == 0);
}

TEST_CASE("Chunk cache: a chunk requested by several threads is decoded once") {
    const Slope source({64, 64, 8}, 8, 1);
    ChunkCache cache(64 * kChunkBytes);
    tbb::parallel_for(0, 640, [&](int n) { static_cast<void>(cache.get(source, {n % 8, n / 8 % 8, 0})); });
    CHECK(source.reads == 64);
    CHECK(cache.bytes() == 64 * kChunkBytes);
}

TEST_CASE("Image levels: a pixel is taken from the coarsest level whose factor divides the pixel size") {
    const ImageLevels levels = Pyramid().open();
    REQUIRE(levels.levels().size() == 3);
    CHECK(levels.levels()[1].factor == Index3{2, 2, 2});
    CHECK(levels.levels()[2].factor == Index3{4, 4, 2});
    CHECK(levels.level_for(1) == 0);
    CHECK(levels.level_for(2) == 1);
    CHECK(levels.level_for(3) == 0);
    CHECK(levels.level_for(4) == 2);
    CHECK(levels.level_for(6) == 1);
    CHECK(levels.level_for(64) == 2);
}

TEST_CASE("Image levels: a level whose voxels are no whole multiple of the finest ones is ignored") {
    Pyramid pyramid;
    pyramid.sources[1].geometry.spacing = {0.8, 0.8, 0.8};
    const ImageLevels levels = pyramid.open();
    REQUIRE(levels.levels().size() == 2);
    CHECK(levels.levels()[1].factor == Index3{4, 4, 2});
    pyramid.sources[2].geometry.size = {11, 6, 18};
    CHECK(pyramid.open().levels().size() == 2);  // one voxel more along x is accepted
    pyramid.sources[2].geometry.size = {17, 6, 18};
    CHECK(pyramid.open().levels().size() == 1);
}

TEST_CASE("Page slice: a whole slice and a part of it are read from their level alone") {
    const Pyramid pyramid;
    const ImageLevels levels = pyramid.open();
    const std::array<double, 2> range{0, 65535};
    const PageSlice whole = make_page_slice(levels, {2, 21, 2, {}}, range);
    CHECK(whole.width == 20);
    CHECK(whole.height == 12);
    CHECK(whole.factor == 2);
    CHECK(pyramid.fine->reads == 0);
    CHECK(pyramid.half->reads == 3 * 2);
    const std::vector<int> values = unpacked(whole);
    for (int y = 0; y < 12; ++y)
        for (int x = 0; x < 20; ++x) CHECK(values[std::size_t(y * 20 + x)] == 2 * (x + 3 * y + 7 * 10));
    const PageSlice part = make_page_slice(levels, {2, 21, 2, SliceRequest::Part{5, 7, 9, 100}}, range);
    CHECK(part.width == 9);
    CHECK(part.height == 5);
    const std::vector<int> part_values = unpacked(part);
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 9; ++x)
            CHECK(part_values[std::size_t(y * 9 + x)] == values[std::size_t((y + 7) * 20 + x + 5)]);
    // If the level's voxels are smaller than a pixel, the pixel is the mean of voxels along each axis.
    const std::vector<int> means = unpacked(make_page_slice(levels, {0, 39, 6, {}}, range));
    REQUIRE(means.size() == 4 * 6);
    CHECK(means[1 * 4 + 2] == 2 * (19 + 3 * 7 + 7 * 4));
    CHECK_THROWS_AS(make_page_slice(levels, {2, 36, 1, {}}, range), Error);
    CHECK_THROWS_AS(make_page_slice(levels, {2, 0, 1, SliceRequest::Part{40, 0, 1, 1}}, range), Error);
}

TEST_CASE("Oblique slice: values are interpolated from the matching level, 0 outside, invalid planes are rejected") {
    const Pyramid pyramid;
    const ImageLevels levels = pyramid.open();
    const std::array<double, 2> range{0, 65535};
    const auto check = [&](const ObliqueRequest& plane, int level) {
        const PageSlice coded = make_oblique_slice(levels, plane, range);
        CHECK(coded.factor == (1 << level));
        const std::vector<int> values = unpacked(coded);
        REQUIRE(values.size() == std::size_t(plane.count) * std::size_t(plane.count));
        int inside = 0, outside = 0;
        for (int y = 0; y < plane.count; ++y)
            for (int x = 0; x < plane.count; ++x) {
                double expected = 0;
                bool is_in_image = true, is_at_rim = false;
                for (std::size_t a = 0; a < 3; ++a) {
                    const double fine = plane.first[a] + x * plane.right[a] + y * plane.down[a];
                    const double at = (fine + 0.5) / (1 << level) - 0.5;
                    is_in_image = is_in_image && fine >= -0.5 && fine <= pyramid.size[a] - 0.5;
                    is_at_rim = is_at_rim || at < 0 || at > pyramid.size[a] / (1 << level) - 1;
                    expected += std::array{1, 3, 7}[a] * at * (1 << level);
                }
                const int value = values[std::size_t(y * plane.count + x)];
                if (!is_in_image) {
                    ++outside;
                    REQUIRE(value == 0);
                } else if (!is_at_rim) {  // at the rim the last voxel's value continues
                    ++inside;
                    REQUIRE(std::abs(value - expected) <= 0.51);
                }
            }
        CHECK(inside > 100);
        CHECK(outside > 100);
    };
    check({{3.25, 4.5, 5}, {0.5, 0.3, 0}, {0.1, 0.2, 0.6}, 70}, 0);
    check({{-3, 20, 2}, {1.6, -1.3, 0.2}, {0.4, 0.3, 2.1}, 40}, 1);
    check({{20, -40, 18}, {0, 0.1, 0}, {0.1, 0, 0}, 500}, 0);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(make_oblique_slice(levels, {{nan, 0, 0}, {1, 0, 0}, {0, 1, 0}, 9}, range), Error);
    CHECK_THROWS_AS(make_oblique_slice(levels, {{0, 0, 0}, {1, 0, 0}, {0, 1e300, 0}, 9}, range), Error);
    CHECK_THROWS_AS(make_oblique_slice(levels, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0}, range), Error);
    CHECK_THROWS_AS(make_oblique_slice(levels, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1025}, range), Error);
    // Pixels that are far apart need no more memory than pixels close to each other.
    CHECK(unpacked(make_oblique_slice(levels, {{1, 1, 1}, {1e6, 0, 0}, {0, 1e6, 0}, 64}, range))[0] > 0);
}

TEST_CASE("Image levels: the chunk cache stays within its limit, percentiles come from the coarsest level") {
    const Pyramid pyramid;
    const ImageLevels levels = pyramid.open(20 * kChunkBytes);
    for (int axis = 0; axis < 3; ++axis)
        for (int at = 0; at < pyramid.size[std::size_t(axis)]; ++at)
            static_cast<void>(make_page_slice(levels, {axis, at, 1, {}}, {0, 1000}));
    CHECK(levels.cache().bytes <= 20 * kChunkBytes);
    CHECK(levels.cache().decoded > 75);  // the finest level has 75 chunks; some were decoded again
    const auto [low, high] = levels.percentiles(0, 1);
    CHECK(low == 0);
    CHECK(high == 4 * (9 + 3 * 5 + 7 * 17));  // the maximum of the coarsest level, from which percentiles are computed
    CHECK(levels.range() == std::array<double, 2>{0, 65535});
}

TEST_CASE("Image levels: slices of an image in memory are means of its voxels, without a chunk cache") {
    const ImageGeometry geometry = geometry_of({4, 3, 2}, {1, 1, 1});
    std::vector<float> values(24);
    for (std::size_t n = 0; n < values.size(); ++n) values[n] = float(n);
    const ImageLevels levels(Image::from_values(geometry, values.data()));
    CHECK_FALSE(levels.is_in_chunks());
    CHECK(levels.cache().max_bytes == 0);
    CHECK(levels.range() == std::array<double, 2>{0, 23});
    const std::vector<int> coded = unpacked(make_page_slice(levels, {2, 1, 2, {}}, {0, 65535}));
    CHECK(coded == std::vector<int>{15, 17, 21, 23});  // means of 2 x 2 voxels, and of the remainder at the end
}
