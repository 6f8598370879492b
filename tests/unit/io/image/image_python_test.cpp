// Images as Python programs write them: NumPy arrays, and tifffile stacks with tifffile's own description.
#include <tiffio.h>

#include <catch2/catch.hpp>
#include <cstring>

#include "covol/image.h"
#include "support/scratch.h"

using namespace covol;

namespace {

constexpr Index3 kSize{4, 3, 2};

/// A .npy of version 1 whose values count up from 0 in the order of the file.
template <typename T>
std::string npy(const std::string& descr, const std::string& order, const std::string& shape, std::size_t count) {
    std::string header = "{'descr': '" + descr + "', 'fortran_order': " + order + ", 'shape': " + shape + ", }";
    header.resize(117, ' ');
    header += '\n';
    std::string bytes = std::string("\x93NUMPY\1\0", 8) + char(header.size()) + '\0' + header;
    for (std::size_t n = 0; n < count; ++n) {
        const T value = T(n);
        bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
    }
    return bytes;
}

/// Checks that the voxels' values are i, j and k times `strides`.
void check_counts(const Image& image, const std::array<int, 3>& strides) {
    REQUIRE(image.geometry().size == kSize);
    int wrong = 0;
    for (int k = 0; k < kSize[2]; ++k)
        for (int j = 0; j < kSize[1]; ++j)
            for (int i = 0; i < kSize[0]; ++i)
                wrong += image.at(i, j, k) == i * strides[0] + j * strides[1] + k * strides[2] ? 0 : 1;
    CHECK(wrong == 0);
}

/// Writes pages of 4 x 3 bytes with the page's number as value, as tifffile writes them.
std::string tifffile(const std::string& path, int pages, const std::string& description) {
    TIFF* tiff = TIFFOpen(path.c_str(), "w");
    for (int page = 0; page < pages; ++page) {
        TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kSize[0]);
        TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kSize[1]);
        TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
        TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, kSize[1]);
        if (page == 0) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
        std::vector<unsigned char> pixels(std::size_t(kSize[0] * kSize[1]), static_cast<unsigned char>(page));
        TIFFWriteEncodedStrip(tiff, 0, pixels.data(), tmsize_t(pixels.size()));
        TIFFWriteDirectory(tiff);
    }
    TIFFClose(tiff);
    return path;
}

}  // namespace

TEST_CASE("NumPy arrays of several types are read in C and Fortran order") {
    const Scratch scratch;
    check_counts(read_image(scratch.write("c.npy", npy<std::uint16_t>("<u2", "False", "(2, 3, 4)", 24))), {1, 4, 12});
    check_counts(read_image(scratch.write("f.npy", npy<float>("<f4", "True", "(2, 3, 4)", 24))), {6, 2, 1});
    check_counts(read_image(scratch.write("b.npy", npy<std::uint8_t>("|b1", "False", "(2, 3, 4)", 24))), {1, 4, 12});
    const ImageInfo info = read_image_info(scratch.path("f.npy"));
    CHECK(info.format == "NumPy array");
    CHECK(info.axis_order == "ZYX");
    CHECK(info.type == PixelType::Float);
    CHECK_FALSE(info.spacing_known[0]);
    CHECK(read_image_info(scratch.path("c.npy")).axis_order == "XYZ");
    std::string big = npy<std::uint16_t>(">u2", "False", "(2, 3, 4)", 24);
    for (std::size_t at = big.size() - 48; at < big.size(); at += 2) std::swap(big[at], big[at + 1]);
    check_counts(read_image(scratch.write("big.npy", big)), {1, 4, 12});
    ReadImageOptions part;
    part.roi = WorldBox{{1, 1, 0}, {2, 1, 1}};
    CHECK(read_image(scratch.path("f.npy"), part).at(2, 1, 1) == 15);
}

TEST_CASE("NumPy files that are invalid or hold no 3D array are rejected") {
    const Scratch scratch;
    const auto is_refused = [&](const std::string& bytes, const std::string& part) {
        CHECK_THAT(message_of([&] { (void)read_image(scratch.write("a.npy", bytes)); }), Catch::Contains(part));
    };
    const std::string good = npy<std::uint16_t>("<u2", "False", "(2, 3, 4)", 24);
    is_refused("this is no array", "expected NumPy's signature");
    is_refused(good.substr(0, 60), "its header claims 118 bytes");
    is_refused(good.substr(0, good.size() - 1), "a.npy");
    is_refused(npy<std::uint16_t>("<u2", "None", "(2, 3, 4)", 24), "expected descr, fortran_order and shape");
    is_refused(npy<double>("<c8", "False", "(2, 3, 4)", 24), "got values of the type '<c8'");
    is_refused(npy<std::uint16_t>("<u2", "False", "(6, 4)", 24), "expected an array of three axes");
    is_refused(npy<std::uint16_t>("<u2", "False", "(2, x, 4)", 24), "expected sizes in its shape");
    is_refused(npy<std::uint16_t>("<u2", "False", "(0, 3, 4)", 0), "expected a 3D image");
}

TEST_CASE("TIFFs of tifffile: axes and spacing are read, and a description that does not fit is ignored") {
    const Scratch scratch;
    const std::string path = scratch.path("t.tif");
    tifffile(path, 4, R"({"shape": [2, 2, 3, 4], "axes": "ZCYX", "spacing": 1.5, "unit": "um"})");
    ImageInfo info = read_image_info(path);
    CHECK(info.format == "tifffile's TIFF");
    CHECK(info.channels == 2);
    CHECK(info.geometry.size == kSize);
    CHECK(info.geometry.spacing[2] == 1.5);
    CHECK(info.geometry.unit == "um");
    ReadImageOptions options;
    options.channel = 1;
    CHECK(read_image(path, options).at(0, 0, 1) == 3);  // the channel varies faster than z from page to page
    tifffile(path, 4, R"({"shape": [2, 2, 3, 4], "axes": "TZYX"})");
    options = {};
    options.frame = 1;
    CHECK(read_image(path, options).at(0, 0, 0) == 2);
    tifffile(path, 4, R"({"shape": [4, 3, 4]})");  // z, y, x if there are no axes
    CHECK(read_image(path).at(0, 0, 3) == 3);
    tifffile(path, 4, R"({"shape": [4, 3, 4], "axes": "TYX"})");  // a movie of a single slice has no third dimension
    CHECK_THAT(message_of([&] { (void)read_image_info(path); }), Catch::Contains("got 4 x 3 x 1"));
    for (const char* wrong : {R"({"shape": [9, 3, 4], "axes": "ZYX"})", R"({"shape": [1, 1, 1, 4, 3, 4]})",
                              "{\"shape\": 4}", "{", R"({"shape": [0, 3, 4], "axes": "ZYX", "spacing": -1})"}) {
        INFO(wrong);
        info = read_image_info(tifffile(path, 4, wrong));
        // A wrong description is ignored, and the pages determine the size.
        CHECK(info.geometry.size == Index3{4, 3, 4});
    }
}
