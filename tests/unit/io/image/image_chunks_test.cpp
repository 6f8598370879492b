// Tests of large files that are decoded in parts: values are those that were written, and damage is an Error.
#include <tbb/parallel_for.h>
#include <tiffio.h>

#include <catch2/catch.hpp>
#include <cstring>

#include "io/image/tiff_pages.h"
#include "io/pixels/inflate.h"
#include "io/pixels/packed_chunks.h"
#include "support/deflated.h"
#include "support/scratch.h"

using namespace covol;
using namespace covol::detail;

namespace {

constexpr int kAdler = 15, kGzip = 15 + 16;

/// The bytes as a single stream, in the format that `kind` selects: kAdler (zlib) or kGzip.
std::string packed(const std::string& bytes, int kind) { return test::deflated(bytes, kind, 1); }

constexpr Index3 kSize{310, 205, 170};

std::uint16_t value(int i, int j, int k) {
    return std::uint16_t((std::uint32_t(i) * 2654435761U + std::uint32_t(j) * 40503U + std::uint32_t(k) * 97U) >> 20);
}

/// 21 MB of values, so that a packed stream of them has several positions at which decoding can start.
std::string ramp() {
    std::string bytes(voxel_count(kSize) * 2, '\0');
    std::size_t at = 0;
    for (int k = 0; k < kSize[2]; ++k)
        for (int j = 0; j < kSize[1]; ++j)
            for (int i = 0; i < kSize[0]; ++i, at += 2) {
                const std::uint16_t v = value(i, j, k);
                std::memcpy(bytes.data() + at, &v, 2);
            }
    return bytes;
}

PackedFrame frame_of_ramp() {
    PackedFrame frame;
    frame.type = PixelType::UInt16;
    frame.size = kSize;
    return frame;
}

PixelPlace place_of(const std::string& path, std::uint64_t offset) {
    PixelPlace place;
    place.path = path;
    place.file_offset = offset;
    place.packed = true;
    place.type = PixelType::UInt16;
    return place;
}

bool has_ramp(const ChunkedVoxels& voxels, const VoxelBox& box) {
    std::vector<std::uint16_t> values(voxel_count(box.size()));
    voxels.copy(box, values.data());
    std::size_t n = 0;
    bool same = true;
    for (int k = box.min[2]; k <= box.max[2]; ++k)
        for (int j = box.min[1]; j <= box.max[1]; ++j)
            for (int i = box.min[0]; i <= box.max[0]; ++i) same = same && values[n++] == value(i, j, k);
    return same;
}

}  // namespace

TEST_CASE("A compressed stream of one or several members is decoded from any position") {
    const Scratch scratch;
    const std::string bytes = ramp();
    std::string several;
    for (std::size_t at = 0; at < bytes.size(); at += 3000001) several += packed(bytes.substr(at, 3000001), kGzip);
    for (const auto& [name, stream] : {std::pair<std::string, std::string>{"gzip", packed(bytes, kGzip)},
                                       {"several", several},
                                       {"zlib", packed(bytes, kAdler)}}) {
        INFO(name);
        const std::string path = scratch.write(name, "head" + stream);
        const InflateIndex index(path, 4, bytes.size(), true, {});
        CHECK(index.size() == 3);
        const auto source = packed_chunks(path, place_of(path, 4), frame_of_ramp(), {});
        {
            const ChunkedVoxels voxels(source);
            CHECK(voxels.at({309, 204, 169}) == value(309, 204, 169));
            CHECK(voxels.at({0, 0, 0}) == value(0, 0, 0));
            CHECK(voxels.at({100, 100, 100}) == value(100, 100, 100));
            CHECK(voxels.read_count() == 3);
        }
        const ChunkedVoxels voxels(source);
        voxels.load({{{10, 20, 30}, {80, 21, 31}}, {{200, 150, 90}, {201, 151, 120}}}, {});
        const std::uint64_t loaded = voxels.read_count();
        CHECK(loaded == voxels.read_chunks().size());
        CHECK(has_ramp(voxels, {{10, 20, 30}, {80, 21, 31}}));
        CHECK(has_ramp(voxels, {{200, 150, 90}, {201, 151, 120}}));
        CHECK(voxels.read_count() == loaded);
        tbb::parallel_for(0, 17, [&](int n) { has_ramp(voxels, {{0, 0, n}, {309, 204, 10 * n}}); });
        CHECK(has_ramp(voxels, whole_box(kSize)));
        CHECK(voxels.read_count() == voxels.chunk_count());
    }
}

TEST_CASE("A channel and frame of a compressed stream are decoded with byte order, slope and intercept") {
    const Scratch scratch;
    constexpr Index3 kSmall{70, 20, 18};
    std::string bytes = "head";
    for (int frame = 0; frame < 2; ++frame)
        for (std::uint64_t n = 0; n < voxel_count(kSmall); ++n)
            for (int c = 0; c < 2; ++c) {
                const auto v = std::int16_t(int(n % 5000) - 100 * c + 7 * frame);
                bytes += char(v >> 8);
                bytes += char(v & 255);
            }
    PixelPlace place = place_of(scratch.write("a", packed(bytes, kGzip)), 0);
    place.type = PixelType::Int16;
    place.swap = true;
    place.slope = 0.5;
    place.intercept = 3;
    PackedFrame frame;
    frame.type = PixelType::Float;
    frame.size = kSmall;
    frame.components = 2;
    frame.channel = 1;
    frame.begin = 4 + 4 * voxel_count(kSmall);
    const ChunkedVoxels voxels(packed_chunks(place.path, place, frame, {}));
    std::vector<float> values(voxel_count(kSmall));
    voxels.copy(whole_box(kSmall), values.data());
    bool same = true;
    for (std::size_t n = 0; n < values.size(); ++n)
        same = same && values[n] == 0.5F * float(int(n % 5000) - 100 + 7) + 3;
    CHECK(same);
}

TEST_CASE("Damaged compressed streams never crash, truncated ones and wrong checksums are errors") {
    const Scratch scratch;
    const std::string bytes = ramp();
    std::string stream = packed(bytes, kGzip);
    const auto open = [&](const std::string& path) {
        const ChunkedVoxels voxels(packed_chunks(path, place_of(path, 0), frame_of_ramp(), {}));
        std::vector<std::uint16_t> values(voxel_count(kSize));
        voxels.copy(whole_box(kSize), values.data());
    };
    const std::string good = scratch.write("good", stream);
    CHECK_NOTHROW(open(good));
    const FuzzCounts counts = fuzz(scratch, good, open, 10);
    CHECK(counts.truncated_accepted == 0);
    stream[stream.size() - 6] ^= 1;
    const std::string wrong = scratch.write("wrong", stream);
    CHECK(message_of([&] { open(wrong); }).find("damaged") != std::string::npos);
}

TEST_CASE("Loading chunks beyond the memory budget is rejected, and a cancelled load reads no chunk") {
    const Scratch scratch;
    const std::string path = scratch.write("a", packed(ramp(), kGzip));
    const ChunkedVoxels voxels(packed_chunks(path, place_of(path, 0), frame_of_ramp(), {}));
    RunContext run;
    run.memory_budget = 1000;
    CHECK(code_of([&] { voxels.load({whole_box(kSize)}, run); }) == Errc::InvalidOptions);
    std::atomic<bool> cancel{true};
    RunContext stopped;
    stopped.cancel = &cancel;
    CHECK(code_of([&] { voxels.load({whole_box(kSize)}, stopped); }) == Errc::Cancelled);
    CHECK(voxels.read_count() == 0);
}

TEST_CASE("TIFF tiles and strips are read one by one and by several threads") {
    constexpr Index3 kPages{700, 530, 5};
    struct Kind {
        int compression, predictor, tile, rows, planes;
        const char* mode;
    };
    for (const Kind& kind :
         {Kind{COMPRESSION_LZW, 2, 0, 1, 1, "w"}, Kind{COMPRESSION_ADOBE_DEFLATE, 2, 0, 530, 1, "w8"},
          Kind{COMPRESSION_ADOBE_DEFLATE, 1, 128, 0, 1, "wb"}, Kind{COMPRESSION_LZW, 1, 1024, 0, 1, "w"},
          Kind{COMPRESSION_ADOBE_DEFLATE, 2, 64, 0, 2, "w8"}, Kind{COMPRESSION_NONE, 1, 0, 37, 1, "wb"}}) {
        INFO(kind.compression << " " << kind.tile << " " << kind.rows << " " << kind.mode);
        const Scratch scratch;
        const std::string path = scratch.path("a.tif");
        TIFF* tiff = TIFFOpen(path.c_str(), kind.mode);
        for (int k = 0; k < kPages[2]; ++k) {
            TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kPages[0]);
            TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kPages[1]);
            TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
            TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.planes);
            TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, kind.planes > 1 ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
            TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
            TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind.compression);
            if (kind.predictor > 1) TIFFSetField(tiff, TIFFTAG_PREDICTOR, kind.predictor);
            if (kind.tile > 0) {
                TIFFSetField(tiff, TIFFTAG_TILEWIDTH, kind.tile);
                TIFFSetField(tiff, TIFFTAG_TILELENGTH, kind.tile);
            } else {
                TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, kind.rows);
            }
            for (int plane = 0; plane < kind.planes; ++plane) {
                // Only the last plane is read; the others have other values.
                const auto shift = plane + 1 < kind.planes ? 9 : 0;
                for (int y = 0; kind.tile == 0 && y < kPages[1]; ++y) {
                    std::vector<std::uint16_t> row;
                    for (int x = 0; x < kPages[0]; ++x) row.push_back(std::uint16_t(value(x, y, k) + shift));
                    TIFFWriteScanline(tiff, row.data(), std::uint32_t(y), std::uint16_t(plane));
                }
                for (int y = 0; kind.tile > 0 && y < kPages[1]; y += kind.tile)
                    for (int x = 0; x < kPages[0]; x += kind.tile) {
                        std::vector<std::uint16_t> tile;
                        for (int n = 0; n < kind.tile * kind.tile; ++n)
                            tile.push_back(std::uint16_t(value(x + n % kind.tile, y + n / kind.tile, k) + shift));
                        TIFFWriteTile(tiff, tile.data(), std::uint32_t(x), std::uint32_t(y), 0, std::uint16_t(plane));
                    }
            }
            TIFFWriteDirectory(tiff);
        }
        TIFFClose(tiff);
        const auto open = [&](const std::string& file) {
            const auto handle = open_for_reading(file);
            TiffFrame frame;
            frame.path = file;
            frame.type = PixelType::UInt16;
            frame.size = kPages;
            frame.kind = current_page(*handle);
            frame.sample = std::uint64_t(kind.planes) - 1;
            frame.files = {file};
            for (std::uint32_t k = 0; k < 5; ++k) frame.slices.push_back({0, k});
            if (frame.kind.width != 700 || frame.kind.height != 530 || frame.kind.bits != 16)
                throw covol::Error(Errc::InvalidInput, "another page");
            return std::make_unique<ChunkedVoxels>(tiff_chunks(frame, tiff_chunk_size(*handle, frame)));
        };
        const auto voxels = open(path);
        const Index3 chunk = voxels->source().chunk_size();
        CHECK(voxel_count(chunk) * 2 >= 65536);
        CHECK(chunk[2] == 1);
        CHECK(voxels->at({699, 529, 4}) == value(699, 529, 4));
        CHECK(voxels->read_count() == 1);
        tbb::parallel_for(0, 40, [&](int n) {
            std::vector<std::uint16_t> values(9 * 9 * 5);
            voxels->copy({{n * 17, n * 13, 0}, {n * 17 + 8, n * 13 + 8, 4}}, values.data());
        });
        CHECK(has_ramp(*voxels, whole_box(kPages)));
        const auto loaded = open(path);
        loaded->load({whole_box(kPages)}, {});
        CHECK(loaded->read_count() == loaded->chunk_count());
        CHECK(has_ramp(*loaded, whole_box(kPages)));
        const auto read_all = [&](const std::string& file) {
            const auto damaged = open(file);
            std::vector<std::uint16_t> values(voxel_count(kPages));
            damaged->copy(whole_box(kPages), values.data());
        };
        fuzz(scratch, path, read_all, 6);
    }
}

TEST_CASE("Image info states the chunk size of large compressed files, and zero for smaller ones") {
    const Scratch scratch;
    const std::string nrrd = "NRRD0004\ntype: uint8\ndimension: 3\nspacings: 1 1 1\nencoding: gzip\nsizes: ";
    const std::string stream = packed(std::string(1U << 20, 'a'), kGzip) + std::string(1U << 16, 'b');
    const std::string large = scratch.write("large.nrrd", nrrd + "650 650 650\n\n" + stream);
    CHECK(read_image_info(large).chunk_size == Index3{64, 64, 16});
    CHECK(read_image_info(large).bytes_to_hold == 0);
    const std::string small = scratch.write("small.nrrd", nrrd + "600 600 600\n\n" + stream);
    CHECK(read_image_info(small).chunk_size == Index3{0, 0, 0});

    // A large TIFF in which only the first tile of each page was written.
    const std::string path = scratch.path("a.tif");
    TIFF* tiff = TIFFOpen(path.c_str(), "w");
    for (int k = 0; k < 3; ++k) {
        TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 16384);
        TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 8192);
        TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
        TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
        TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 512);
        TIFFSetField(tiff, TIFFTAG_TILELENGTH, 256);
        std::string tile(512 * 256, 'a');
        TIFFWriteTile(tiff, tile.data(), 0, 0, 0, 0);
        TIFFWriteDirectory(tiff);
    }
    TIFFClose(tiff);
    CHECK(read_image_info(path).chunk_size == Index3{512, 256, 1});
}
