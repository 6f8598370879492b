// Reading a part of an image: the same values as the whole, and an error outside.
#include <catch2/catch.hpp>

#include "covol/image.h"
#include "support/resident.h"
#include "support/scratch.h"

using namespace covol;

namespace {

ImageGeometry lattice() {
    ImageGeometry g;
    g.size = {40, 33, 17};
    g.spacing = {0.5, 0.75, 2.0};
    g.origin = {10, -20, 30};
    g.unit = "um";
    return g;
}

std::vector<std::uint8_t> values() {
    std::vector<std::uint8_t> all;
    std::uint32_t state = 1;
    for (int n = 0; n < 40 * 33 * 17; ++n)
        all.push_back(static_cast<std::uint8_t>((state = state * 1664525U + 1013904223U) >> 24));
    return all;
}

const WorldBox kRoi{{15.2, -10.1, 41}, {20.1, -4.3, 49.5}};

}  // namespace

TEST_CASE("A part of an image has the same values as the whole image, in several formats") {
    const Scratch scratch;
    const ImageGeometry g = lattice();
    ReadImageOptions options;
    options.roi = kRoi;
    for (const char* name : {"a.nrrd", "a.nii", "a.nii.gz", "a.mha", "a.tif"}) {
        INFO(name);
        write_image(scratch.path(name), g, values().data());
        const Image whole = read_image(scratch.path(name)), part = read_image(scratch.path(name), options);
        const VoxelBox box = part.held();
        CHECK(box == voxels_around(g, kRoi));
        CHECK(box.size() == Index3{14, 11, 8});
        CHECK(part.geometry().size == g.size);
        const Image crop = part.cropped();
        CHECK(crop.geometry().size == box.size());
        bool same = true;
        for (int k = box.min[2]; k <= box.max[2]; ++k)
            for (int j = box.min[1]; j <= box.max[1]; ++j)
                for (int i = box.min[0]; i <= box.max[0]; ++i)
                    same = same && part.at(i, j, k) == whole.at(i, j, k) &&
                           crop.at(i - box.min[0], j - box.min[1], k - box.min[2]) == whole.at(i, j, k);
        CHECK(same);
        CHECK(crop.range() == part.range());
        const Vec3 a = crop.geometry().index_to_world({1, 2, 3});
        const Vec3 b = g.index_to_world({box.min[0] + 1.0, box.min[1] + 2.0, box.min[2] + 3.0});
        for (int c = 0; c < 3; ++c) CHECK(a[c] == Approx(b[c]));

        const Domain frame = make_domain(kRoi, 0.4);
        std::vector<float> from_part(std::size_t(frame.voxel_count())), from_whole(from_part.size());
        part.sample(frame, frame.min, frame.max, from_part.data());
        whole.sample(frame, frame.min, frame.max, from_whole.data());
        CHECK(from_part == from_whole);
    }
}

TEST_CASE("Sampling beyond the loaded part is an error, and beyond the image it continues the border values") {
    const Scratch scratch;
    write_image(scratch.path("a.nrrd"), lattice(), values().data());
    ReadImageOptions options;
    options.roi = WorldBox{{0, -30, 0}, {12, -15, 40}};  // a corner
    const Image part = read_image(scratch.path("a.nrrd"), options);
    Domain frame;
    frame.origin = {10, -20, 30};
    float out[1];
    part.sample(frame, {-5, -5, -5}, {-5, -5, -5}, out);
    CHECK(out[0] == float(part.at(0, 0, 0)));
    CHECK_THROWS_AS(part.sample(frame, {8, 0, 0}, {8, 0, 0}, out), Error);
    CHECK_THROWS_AS(part.sample(frame, {0, 0, 20}, {0, 0, 20}, out), Error);
    options.roi = WorldBox{{0, 0, 0}, {1, 1, 1}};
    CHECK(message_of([&] { (void)read_image(scratch.path("a.nrrd"), options); }).find("outside the image") !=
          std::string::npos);
}

TEST_CASE("A file of 3 GiB is memory-mapped, and a region needs memory for its voxels alone") {
    const Scratch scratch;
    // A sparse file of 3 GiB, in which one voxel is not 0.
    constexpr std::uint64_t kSize = 1448;
    const std::string header =
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1448 1448 1448\nspacings: 1 1 2\nencoding: raw\n\n";
    const std::string path = scratch.write("big.nrrd", header);
    std::filesystem::resize_file(path, header.size() + kSize * kSize * kSize);
    {
        std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(static_cast<std::streamoff>(header.size() + (700 * kSize + 600) * kSize + 500));
        file.put(42);
    }
    const ImageInfo info = read_image_info(path);
    CHECK(info.bytes_to_hold == 0);
    const Image image = read_image(path);
    CHECK(image.at(500, 600, 700) == 42);
    CHECK(image.at(501, 600, 700) == 0);

    // Pages of the mapped file that were read count as resident memory until they are released.
    const std::uint64_t before = resident_bytes();
    constexpr std::uint64_t kTouched = std::uint64_t(32) << 20;
    double sum = 0;
    for (int k = 0; k < 8; ++k)
        for (int j = 0; j < int(kSize); ++j)
            for (int i = 0; i < int(kSize); i += 512) sum += image.at(i, j, 2 * k);
    CHECK(sum == 0);
    CHECK(resident_bytes() > before + kTouched / 2);
    image.release();
    CHECK(resident_bytes() < before + kTouched / 8);
    CHECK(image.at(500, 600, 700) == 42);

    ReadImageOptions options;
    options.roi = WorldBox{{499, 599, 1399}, {501, 601, 1401}};
    CHECK(read_image_info(path, options).bytes_to_hold == 5U * 5U * 5U);
    CHECK(read_image(path, options).at(500, 600, 700) == 42);
    std::filesystem::resize_file(path, header.size() + kSize * kSize * kSize - 1);
    CHECK(message_of([&] { (void)read_image(path); }).find("truncated") != std::string::npos);
}
