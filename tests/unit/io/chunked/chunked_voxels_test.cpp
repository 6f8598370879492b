// Tests of chunks that are decoded on demand: each once, with the same values as if all were decoded at once.
#include <tbb/parallel_for.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>

#include "covol/image.h"
#include "io/pixels/chunks.h"
#include "support/resident.h"
#include "support/scratch.h"
#include "unit/io/chunked/zarr_stores.h"

using namespace covol;
using detail::ChunkedVoxels;

namespace {

/// Voxel (i,j,k) is i + 100 j + 10000 k.
class Numbered : public detail::ChunkSource {
public:
    Numbered(const Index3& size, const Index3& chunk) : ChunkSource("numbered", PixelType::Float, size, chunk) {}

    [[nodiscard]] bool read(const Index3& c, void* out) const override {
        ++reads;
        const Index3& n = chunk_size();
        auto* value = static_cast<float*>(out);
        for (int k = c[2] * n[2]; k < (c[2] + 1) * n[2]; ++k)
            for (int j = c[1] * n[1]; j < (c[1] + 1) * n[1]; ++j)
                for (int i = c[0] * n[0]; i < (c[0] + 1) * n[0]; ++i)
                    *value++ = bad == Index3{i, j, k} ? std::numeric_limits<float>::quiet_NaN() : number(i, j, k);
        return true;
    }
    static float number(int i, int j, int k) { return float(i) + 100.0F * float(j) + 10000.0F * float(k); }

    mutable std::atomic<int> reads{0};
    Index3 bad{-1, -1, -1};
};

/// A source in which all chunks but the first one are missing; their voxels have the fill value.
class Missing : public Numbered {
public:
    using Numbered::Numbered;
    [[nodiscard]] bool read(const Index3& c, void* out) const override {
        return c == Index3{0, 0, 0} && Numbered::read(c, out);
    }
    [[nodiscard]] double fill_value() const noexcept override { return -3; }
};

/// Writes an array of 1024^2 x 256 voxels of one byte, large enough to be read chunk by chunk. Only eight chunks of
/// 64^3 exist.
std::string write_large(const Scratch& scratch) {
    const std::string folder = scratch.path("large");
    std::string meta = zarr_stores::metadata_2(1024, 64, "|u1", "zstd", "5");
    meta.replace(meta.find("[1024"), 5, "[256");
    zarr_stores::write(folder + "/.zarray", meta);
    for (int n = 0; n < 8; ++n)
        zarr_stores::write(folder + "/" + std::to_string(1 + n / 4) + "." + std::to_string(7 + n / 2 % 2) + "." +
                               std::to_string(3 + n % 2),
                           zarr_stores::pack("zstd", zarr_stores::random_bytes(64 * 64 * 64, unsigned(n))));
    return folder;
}

/// A box around the chunks that exist. World coordinates equal indices.
const WorldBox kPart{{180, 440, 60}, {330, 590, 200}};

}  // namespace

TEST_CASE("Chunks: voxels and boxes have the values of the source, across chunks and at the image's end") {
    const auto source = std::make_shared<Numbered>(Index3{23, 17, 9}, Index3{8, 5, 4});
    const ChunkedVoxels voxels(source);
    CHECK(voxels.chunk_count() == 3 * 4 * 3);
    for (const VoxelBox& box : {VoxelBox{{0, 0, 0}, {22, 16, 8}}, VoxelBox{{7, 4, 3}, {8, 5, 4}},
                                VoxelBox{{22, 16, 8}, {22, 16, 8}}, VoxelBox{{3, 9, 0}, {20, 10, 7}}}) {
        std::vector<float> values(detail::voxel_count(box.size()));
        voxels.copy(box, values.data());
        bool same = true;
        std::size_t n = 0;
        for (int k = box.min[2]; k <= box.max[2]; ++k)
            for (int j = box.min[1]; j <= box.max[1]; ++j)
                for (int i = box.min[0]; i <= box.max[0]; ++i, ++n)
                    same = same && values[n] == Numbered::number(i, j, k) && voxels.at({i, j, k}) == double(values[n]);
        CHECK(same);
    }
    CHECK(source->reads == 36);
    CHECK(voxels.read_count() == 36);
    CHECK(voxels.box_of(35) == VoxelBox{{16, 15, 8}, {22, 16, 8}});
}

TEST_CASE("Chunks: each requested chunk is decoded once, and no other chunk") {
    const auto source = std::make_shared<Numbered>(Index3{64, 64, 64}, Index3{16, 16, 16});
    const ChunkedVoxels voxels(source);
    std::atomic<int> wrong{0};
    tbb::parallel_for(0, 20000, [&](int n) {
        const Index3 v{n % 32, n / 32 % 32, n / 1024};
        if (voxels.at(v) != double(Numbered::number(v[0], v[1], v[2]))) ++wrong;
        float pair[8];
        voxels.copy({{15, 15, 15}, {16, 16, 16}}, pair);
        if (pair[7] != Numbered::number(16, 16, 16)) ++wrong;
    });
    CHECK(wrong == 0);
    CHECK(source->reads == 8);
    CHECK(voxels.read_chunks() == std::vector<std::uint64_t>{0, 1, 4, 5, 16, 17, 20, 21});
}

TEST_CASE("Chunks: all missing chunks are one chunk of fill values in memory") {
    const ChunkedVoxels voxels(std::make_shared<Missing>(Index3{512, 512, 512}, Index3{128, 128, 128}));
    const std::uint64_t before = resident_bytes();
    voxels.load({detail::whole_box({512, 512, 512})}, {});
    CHECK(voxels.read_count() == 64);
    CHECK(resident_bytes() < before + 8 * 128 * 128 * 128 * sizeof(float));
    CHECK(voxels.at({127, 5, 6}) == double(Numbered::number(127, 5, 6)));
    CHECK(voxels.at({128, 5, 6}) == -3);
    float pair[2];
    voxels.copy({{127, 5, 6}, {128, 5, 6}}, pair);
    CHECK(pair[0] == Numbered::number(127, 5, 6));
    CHECK(pair[1] == -3);
}

TEST_CASE("Chunks: alternating access to two images does not mix their chunks") {
    const auto a = std::make_shared<Numbered>(Index3{8, 8, 8}, Index3{8, 8, 8});
    const ChunkedVoxels first(a), second(std::make_shared<Numbered>(Index3{8, 8, 8}, Index3{4, 4, 4}));
    for (int n = 0; n < 8; ++n) CHECK(first.at({n, 1, 2}) == second.at({n, 1, 2}));
}

TEST_CASE("Chunks: NaN is an error at each access to its chunk, but is ignored beyond the image's end") {
    const auto source = std::make_shared<Numbered>(Index3{10, 10, 10}, Index3{8, 8, 8});
    source->bad = {9, 3, 2};
    const ChunkedVoxels voxels(source);
    CHECK(voxels.at({1, 1, 1}) == double(Numbered::number(1, 1, 1)));
    float value = 0;
    for (int n = 0; n < 2; ++n) {
        CHECK(message_of([&] {
                  voxels.copy({{8, 0, 0}, {8, 0, 0}}, &value);
              }).find("voxel (9, 3, 2)") != std::string::npos);
        CHECK_THROWS_AS(voxels.at({8, 0, 0}), Error);
    }
    source->bad = {10, 3, 2};
    CHECK(ChunkedVoxels(source).at({8, 0, 0}) == 8.0);
}

TEST_CASE("Chunks: a chunk size of zero or of 2000^3 voxels is rejected") {
    CHECK(code_of([] { Numbered({9, 9, 9}, {0, 4, 4}); }) == Errc::InvalidInput);
    CHECK(code_of([] { Numbered({9, 9, 9}, {2000, 2000, 2000}); }) == Errc::Unsupported);
}

TEST_CASE("Chunks: samples of an image read in chunks are bitwise equal to those of an image in memory") {
    const Scratch scratch;
    const std::string path = write_large(scratch);
    const Image lazy = read_image(path);
    REQUIRE(lazy.chunks());
    CHECK(lazy.chunks()->read == 0);
    CHECK(lazy.chunks()->total == 16 * 16 * 4);
    ReadImageOptions options;
    options.roi = kPart;
    const Image held = read_image(path, options);
    CHECK(held.chunks()->read == 4 * 4 * 4);

    ImageGeometry turned = lazy.geometry();
    turned.spacing = {0.5, 0.75, 1.25};
    turned.origin = {3, 4, 5};
    const double c = std::cos(0.3), s = std::sin(0.3);
    turned.direction = {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
    for (const ImageGeometry& g : {lazy.geometry(), turned}) {
        const Image a = lazy.placed(g), b = held.placed(g);
        Domain frame;
        frame.voxel_size = 0.8;
        frame.origin = g.index_to_world({250, 500, 120});
        std::vector<float> from_lazy(24 * 24 * 24), from_held(from_lazy.size());
        a.sample(frame, {-12, -12, -12}, {11, 11, 11}, from_lazy.data());
        b.sample(frame, {-12, -12, -12}, {11, 11, 11}, from_held.data());
        CHECK(std::memcmp(from_lazy.data(), from_held.data(), sizeof(float) * from_lazy.size()) == 0);
        CHECK(*std::max_element(from_lazy.begin(), from_lazy.end()) > 40);
    }
    CHECK(lazy.chunks()->read == 8);
    CHECK(lazy.at(250, 500, 120) == held.at(250, 500, 120));
    CHECK(lazy.at(0, 0, 0) == 5);
    const Image crop = lazy.cropped();
    CHECK(crop.at(250, 500, 120) == lazy.at(250, 500, 120));
}

TEST_CASE("Chunks: percentiles and range depend on the chunks that were read, not on the thread count") {
    const Scratch scratch;
    const std::string path = write_large(scratch);
    const auto measure = [&](int threads, bool touch) {
        RunContext run;
        run.threads = threads;
        const Image image = read_image(path, {}, run);
        with_threads(run, [&] {
            tbb::parallel_for(0, touch ? 64 : 0, [&](int n) {
                Domain frame;
                frame.origin = {200.0 + 25 * (n % 4), 460.0 + 25 * (n / 4 % 4), 80.0 + 25 * (n / 16)};
                float out[512];
                image.sample(frame, {0, 0, 0}, {7, 7, 7}, out);
            });
        });
        const auto p = image.percentiles(0.1, 0.9), r = image.range();
        return std::array<double, 5>{p[0], p[1], r[0], r[1], double(image.chunks()->read)};
    };
    const auto touched = measure(1, true);
    CHECK(touched[2] == 0);
    CHECK(touched[3] == 63);
    CHECK(touched == measure(2, true));
    CHECK(touched == measure(8, true));
    // If nothing was read before, percentiles() and range() decode some chunks, which lie on a lattice.
    const auto untouched = measure(1, false);
    CHECK(untouched[4] == 27);
    CHECK(untouched == measure(8, false));
}
