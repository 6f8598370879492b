#include "covol/image.h"

#include <tiffio.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "support/ramp_image.h"
#include "support/scratch.h"

using namespace covol;
using namespace covol::test;

namespace {

template <typename T>
bool same_values(const Image& image, const std::vector<T>& values) {
    std::size_t n = 0;
    bool same = true;
    for (int k = 0; k < image.geometry().size[2]; ++k)
        for (int j = 0; j < image.geometry().size[1]; ++j)
            for (int i = 0; i < image.geometry().size[0]; ++i) same = same && image.at(i, j, k) == double(values[n++]);
    return same && n == values.size();
}

void check_frame(const ImageGeometry& a, const ImageGeometry& b, double tolerance) {
    for (const Vec3& index : {Vec3{0, 0, 0}, Vec3{6, 0, 0}, Vec3{0, 5, 0}, Vec3{0, 0, 4}, Vec3{3.5, 2.25, 1}})
        for (int c = 0; c < 3; ++c)
            CHECK(a.index_to_world(index)[c] == Approx(b.index_to_world(index)[c]).margin(tolerance));
}

struct TiffFormat {
    int bits = 8, format = SAMPLEFORMAT_UINT, samples = 1, compression = COMPRESSION_NONE;
    bool tiled = false;
    const char* mode = "w";
    std::string description = {};
    float resolution = 0;
    int pages = 3;
};

/// Writes a TIFF with pages of 20 x 17 pixels, whose samples are value(page, x, y).
template <typename T>
std::string make_tiff(const std::string& path, const TiffFormat& f, T (*value)(int page, int x, int y)) {
    constexpr int kWidth = 20, kHeight = 17;
    TIFF* tiff = TIFFOpen(path.c_str(), f.mode);
    for (int page = 0; page < f.pages; ++page) {
        TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kWidth);
        TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kHeight);
        TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, f.bits);
        TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, f.format);
        TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, f.samples);
        TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, f.samples == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
        TIFFSetField(tiff, TIFFTAG_COMPRESSION, f.compression);
        if (f.resolution > 0) {
            TIFFSetField(tiff, TIFFTAG_XRESOLUTION, f.resolution);
            TIFFSetField(tiff, TIFFTAG_YRESOLUTION, f.resolution);
            TIFFSetField(tiff, TIFFTAG_RESOLUTIONUNIT, RESUNIT_NONE);
        }
        if (page == 0 && !f.description.empty()) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, f.description.c_str());
        if (f.tiled) {
            TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 16);
            TIFFSetField(tiff, TIFFTAG_TILELENGTH, 16);
            for (int y0 = 0; y0 < kHeight; y0 += 16)
                for (int x0 = 0; x0 < kWidth; x0 += 16) {
                    std::vector<T> tile(256, T(99));
                    for (int y = y0; y < std::min(y0 + 16, kHeight); ++y)
                        for (int x = x0; x < std::min(x0 + 16, kWidth); ++x)
                            tile[static_cast<std::size_t>((y - y0) * 16 + x - x0)] = value(page, x, y);
                    TIFFWriteTile(tiff, tile.data(), static_cast<std::uint32_t>(x0), static_cast<std::uint32_t>(y0), 0,
                                  0);
                }
        } else {
            TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 5);  // the last strip is shorter
            for (int y = 0; y < kHeight; ++y) {
                std::vector<T> row;
                for (int x = 0; x < kWidth; ++x)
                    for (int s = 0; s < f.samples; ++s) row.push_back(value(page, x, y));
                TIFFWriteScanline(tiff, row.data(), static_cast<std::uint32_t>(y), 0);
            }
        }
        TIFFWriteDirectory(tiff);
    }
    TIFFClose(tiff);
    return path;
}

template <typename T>
T number(int page, int x, int y) {
    return static_cast<T>(page * 60 + x + 2 * y - (std::is_signed_v<T> ? 50 : 0));
}

template <typename T>
void check_tiff(const std::string& path, PixelType type) {
    const Image image = read_image(path);
    CHECK(image.pixel_type() == type);
    REQUIRE(image.geometry().size == Index3{20, 17, 3});
    bool same = true;
    for (int z = 0; z < 3; ++z)
        for (int y = 0; y < 17; ++y)
            for (int x = 0; x < 20; ++x) same = same && image.at(x, y, z) == double(number<T>(z, x, y));
    CHECK(same);
}

std::string read_error(const std::string& path, const ReadImageOptions& options = {}) {
    return message_of([&] { (void)read_image(path, options); });
}

}  // namespace

TEST_CASE("Images are read as written: values, type, spacing, origin and direction") {
    const Scratch scratch;
    const ImageGeometry g = oblique();
    for (const char* name : {"a.nrrd", "a.nii", "a.nii.gz", "a.mha"}) {
        INFO(name);
        const std::string path = scratch.path(name);
        // The geometry in NIfTI's header has single precision.
        const double tolerance = std::string(name).find("nii") != std::string::npos ? 1e-5 : 1e-9;
        write_image(path, g, ramp<std::int32_t>(g).data());
        Image image = read_image(path);
        CHECK(image.pixel_type() == PixelType::Int32);
        CHECK(same_values(image, ramp<std::int32_t>(g)));
        check_frame(image.geometry(), g, tolerance);
        CHECK(image.geometry().spacing_known);
        check_frame(read_image_geometry(path), g, tolerance);

        write_image(path, g, ramp<std::uint8_t>(g).data());
        image = read_image(path);
        CHECK(image.pixel_type() == PixelType::UInt8);
        CHECK(same_values(image, ramp<std::uint8_t>(g)));

        write_image(path, g, ramp<float>(g).data());
        image = read_image(path);
        CHECK(image.pixel_type() == PixelType::Float);
        CHECK(same_values(image, ramp<float>(g)));
    }
    CHECK(scratch.file_count() == 4);
}

TEST_CASE("A TIFF preserves spacing and unit") {
    const Scratch scratch;
    ImageGeometry g = oblique();
    g.spacing = {0.35, 0.35, 1.25};
    g.unit = "um";
    const std::string path = scratch.path("a.tif");
    write_image(path, g, ramp<std::int32_t>(g).data());
    CHECK(same_values(read_image(path), ramp<std::int32_t>(g)));
    write_image(path, g, ramp<float>(g).data());
    CHECK(same_values(read_image(path), ramp<float>(g)));
    write_image(path, g, ramp<std::uint8_t>(g).data());
    const Image image = read_image(path);
    CHECK(image.pixel_type() == PixelType::UInt8);
    CHECK(same_values(image, ramp<std::uint8_t>(g)));
    CHECK(image.geometry().spacing == g.spacing);
    CHECK(image.geometry().unit == "um");
    CHECK(image.geometry().spacing_known);
}

TEST_CASE("A TIFF written without known spacing is read without known spacing") {
    const Scratch scratch;
    ImageGeometry g;
    g.size = {7, 6, 5};
    g.spacing_known = false;
    write_image(scratch.path("a.tif"), g, ramp<std::uint8_t>(g).data());
    CHECK_FALSE(read_image_geometry(scratch.path("a.tif")).spacing_known);
}

TEST_CASE("NIfTI: slope and intercept are applied") {
    const Scratch scratch;
    const ImageGeometry g = oblique();
    write_image(scratch.path("a.nii"), g, ramp<std::int32_t>(g).data());
    std::string bytes = bytes_of(scratch.path("a.nii"));
    const std::array<float, 2> scale{2.0F, -5.0F};
    std::memcpy(bytes.data() + 112, scale.data(), sizeof(scale));
    const Image image = read_image(scratch.write("a.nii", bytes));
    CHECK(image.pixel_type() == PixelType::Float);
    CHECK(image.at(0, 0, 0) == -5);
    CHECK(image.at(3, 2, 1) == 2 * (3 + 20 + 40) - 5);
}

TEST_CASE("The unit is preserved in NRRD and MetaImage files") {
    const Scratch scratch;
    ImageGeometry g = oblique();
    g.unit = "um";
    for (const char* name : {"u.nrrd", "u.mha"}) {
        INFO(name);
        write_image(scratch.path(name), g, ramp<std::uint8_t>(g).data());
        CHECK(read_image_geometry(scratch.path(name)).unit == "um");
    }
}

TEST_CASE("TIFF: every pixel type is read, from strips or tiles, compressed or not, classic or BigTIFF") {
    const Scratch scratch;
    const std::string path = scratch.path("k.tif");
    make_tiff<std::uint8_t>(path, {8, SAMPLEFORMAT_UINT}, number);
    check_tiff<std::uint8_t>(path, PixelType::UInt8);
    make_tiff<std::int8_t>(path, {8, SAMPLEFORMAT_INT}, number);
    check_tiff<std::int8_t>(path, PixelType::Int8);
    make_tiff<std::uint16_t>(path, {16, SAMPLEFORMAT_UINT, 1, COMPRESSION_LZW}, number);
    check_tiff<std::uint16_t>(path, PixelType::UInt16);
    make_tiff<std::int16_t>(path, {16, SAMPLEFORMAT_INT, 1, COMPRESSION_ADOBE_DEFLATE, false, "wb"}, number);
    check_tiff<std::int16_t>(path, PixelType::Int16);
    make_tiff<std::uint32_t>(path, {32, SAMPLEFORMAT_UINT, 1, COMPRESSION_NONE, false, "w8"}, number);
    check_tiff<std::uint32_t>(path, PixelType::UInt32);
    make_tiff<std::int32_t>(path, {32, SAMPLEFORMAT_INT, 1, COMPRESSION_PACKBITS}, number);
    check_tiff<std::int32_t>(path, PixelType::Int32);
    make_tiff<float>(path, {32, SAMPLEFORMAT_IEEEFP, 1, COMPRESSION_LZW, true}, number);
    check_tiff<float>(path, PixelType::Float);
    make_tiff<double>(path, {64, SAMPLEFORMAT_IEEEFP, 1, COMPRESSION_ADOBE_DEFLATE, true, "wb"}, number);
    check_tiff<double>(path, PixelType::Double);
}

TEST_CASE("TIFF: spacing and unit of ImageJ and OME are read, and the options take precedence") {
    const Scratch scratch;
    const std::string path = scratch.path("s.tif");
    const auto geometry = [&](const std::string& description, float resolution) {
        TiffFormat f;
        f.description = description;
        f.resolution = resolution;
        return read_image_geometry(make_tiff<std::uint8_t>(path, f, number));
    };
    ImageGeometry g = geometry("ImageJ=1.53t\nimages=3\nslices=3\nunit=\\u00B5m\nspacing=1.5\n", 1.0F / 0.35F);
    CHECK(g.spacing == Vec3{0.35, 0.35, 1.5});
    CHECK(g.unit == "um");
    CHECK(g.spacing_known);
    g = geometry("ImageJ=1.53t\nimages=3\nslices=3\nunit=micron\n", 4.0F);
    CHECK(g.spacing == Vec3{0.25, 0.25, 1.0});
    CHECK(g.unit == "um");
    g = geometry("ImageJ=1.11a\nimages=3\nslices=3\n", 1.0F);
    CHECK(g.spacing == Vec3{1, 1, 1});
    CHECK_FALSE(g.spacing_known);
    g = geometry("", 72.0F);  // dots per inch of a scanner, not a voxel size
    CHECK(g.spacing == Vec3{1, 1, 1});
    CHECK_FALSE(g.spacing_known);
    g = geometry(
        "<?xml version=\"1.0\"?><OME><Image><Pixels DimensionOrder=\"XYZCT\" SizeC=\"1\" SizeT=\"1\" SizeX=\"20\" "
        "SizeY=\"17\" SizeZ=\"3\" PhysicalSizeX=\"0.2\" PhysicalSizeXUnit=\"\xC2\xB5m\" PhysicalSizeY=\"0.2\" "
        "PhysicalSizeYUnit=\"\xC2\xB5m\" PhysicalSizeZ=\"700\" PhysicalSizeZUnit=\"nm\" Type=\"uint8\"/></Image></OME>",
        0);
    CHECK(g.spacing[0] == Approx(0.2));
    CHECK(g.spacing[2] == Approx(0.7));
    CHECK(g.unit == "um");
    CHECK(g.spacing_known);
    // The spacing in the options takes precedence over that of the file.
    ReadImageOptions stated;
    stated.spacing = Vec3{0.4, 0.5, 3};
    CHECK(read_image_geometry(path, stated).spacing == stated.spacing);
}

TEST_CASE("TIFF: the selected channel and frame of a hyperstack are read") {
    const Scratch scratch;
    TiffFormat f;
    f.pages = 12;
    f.description = "ImageJ=1.53t\nimages=12\nchannels=2\nslices=3\nframes=2\nhyperstack=true\n";
    const auto page_number = [](int page, int, int) { return static_cast<std::uint8_t>(page); };
    const std::string path = make_tiff<std::uint8_t>(scratch.path("h.tif"), f, page_number);
    CHECK(read_error(path).find("expected one channel, got 2") != std::string::npos);
    ReadImageOptions options;
    options.channel = 1;
    CHECK(read_error(path, options).find("choose 0 to 1 with `frame`") != std::string::npos);
    options.frame = 1;
    Image image = read_image(path, options);
    CHECK(image.geometry().size == Index3{20, 17, 3});
    for (int z = 0; z < 3; ++z) CHECK(image.at(4, 5, z) == 6 + 2 * z + 1);
    options.frame = 2;
    CHECK(read_error(path, options).find("frame 2 does not exist") != std::string::npos);

    f.description = "<OME><Pixels DimensionOrder=\"XYZTC\" SizeC=\"2\" SizeT=\"2\" SizeZ=\"3\"/></OME>";
    make_tiff<std::uint8_t>(path, f, page_number);
    options.frame = 1;
    image = read_image(path, options);
    for (int z = 0; z < 3; ++z) CHECK(image.at(4, 5, z) == 6 + 3 + z);
}

TEST_CASE("TIFF: huge stacks of ImageJ, with one directory and consecutive slices, are read") {
    const Scratch scratch;
    const std::string path = scratch.path("one.tif");
    for (const char* mode : {"wl", "wb"}) {
        TIFF* tiff = TIFFOpen(path.c_str(), mode);
        TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 4);
        TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 2);
        TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
        TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 2);
        TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, "ImageJ=1.53t\nimages=3\nslices=3\n");
        std::vector<std::uint16_t> page(8);
        for (std::size_t n = 0; n < 8; ++n) page[n] = static_cast<std::uint16_t>(1000 + n);
        TIFFWriteEncodedStrip(tiff, 0, page.data(), 16);
        TIFFClose(tiff);
        // The strip lies at the file's beginning. Its offset is replaced by that of the pixels that are appended here.
        std::string bytes = bytes_of(path);
        const bool big = mode[1] == 'b';
        const auto text = [&](std::uint64_t value, int width) {
            std::string t;
            for (int b = 0; b < width; ++b) t += static_cast<char>(value >> 8 * (big ? width - 1 - b : b));
            return t;
        };
        const std::string old_entry = text(TIFFTAG_STRIPOFFSETS, 2) + text(TIFF_LONG, 2) + text(1, 4) + text(8, 4);
        const std::size_t at = bytes.find(old_entry);
        REQUIRE(at != std::string::npos);
        bytes.replace(at, 12, text(TIFFTAG_STRIPOFFSETS, 2) + text(TIFF_LONG, 2) + text(1, 4) + text(bytes.size(), 4));
        for (std::uint64_t n = 0; n < 24; ++n) bytes += text(1000 + n, 2);
        scratch.write("one.tif", bytes);
        const Image image = read_image(path);
        REQUIRE(image.geometry().size == Index3{4, 2, 3});
        CHECK(image.at(0, 0, 0) == 1000);
        CHECK(image.at(3, 1, 2) == 1023);
    }
}

TEST_CASE("Unusable images are rejected with a message of one line that states the reason") {
    const Scratch scratch;
    const auto contains = [](const std::string& message, const std::string& part) {
        INFO(message);
        CHECK(message.find(part) != std::string::npos);
        CHECK(message.find('\n') == std::string::npos);
    };
    contains(read_error(scratch.path("none.nrrd")), "no such file");
    for (const char* name : {"t.nrrd", "t.nii", "t.nii.gz", "t.mha", "t.mhd", "t.tif"}) {
        INFO(name);
        contains(read_error(scratch.write(name, "")), "the file is empty");
        contains(read_error(scratch.write(name, "this is just text\nnothing else\n")), name);
    }
    contains(read_error(scratch.write("a.jpg", "x")), "expected a name ending in");
    contains(read_error(make_tiff<std::uint8_t>(scratch.path("rgb.tif"), {8, SAMPLEFORMAT_UINT, 3}, number)),
             "expected one channel, got 3; choose 0 (red), 1 (green), 2 (blue) with `channel`");
    TiffFormat one_page;
    one_page.pages = 1;
    contains(read_error(make_tiff<std::uint8_t>(scratch.path("flat.tif"), one_page, number)),
             "expected a 3D image, got 20 x 17 x 1");
    ImageGeometry flat;
    flat.size = {5, 4, 1};
    write_image(scratch.path("flat.nrrd"), flat, std::vector<std::uint8_t>(20).data());
    contains(read_error(scratch.path("flat.nrrd")), "expected a 3D image, got 5 x 4 x 1");
    const std::string header = "NRRD0004\ntype: uint8\nencoding: raw\nendian: little\n";
    contains(read_error(scratch.write("2d.nrrd", header + "dimension: 2\nsizes: 3 2\n\nabcdef")), "got 3 x 2 x 1");
    contains(read_error(scratch.write(
                 "rgb.nrrd", header + "dimension: 4\nsizes: 3 2 2 2\nkinds: RGB-color domain domain domain\n\n" +
                                 std::string(24, 'a'))),
             "expected one channel, got 3");
    contains(read_error(scratch.write("4d.nrrd", header + "dimension: 4\nsizes: 2 2 2 3\n\n" + std::string(24, 'a'))),
             "expected one frame, got 3; choose 0 to 2 with `frame`");
    contains(read_error(scratch.write("huge.nrrd", header + "dimension: 3\nsizes: 100000 100000 100000\n\nabc")),
             "cannot hold");
    contains(
        read_error(scratch.write("plane.nrrd", header + "dimension: 3\nsizes: 2 2 2\nspace dimension: 3\n"
                                                        "space directions: (1,0,0) (0.5,1,0) (1,1,0.01)\n\nabcdefgh")),
        "axes that span the space");
    const ImageGeometry g = oblique();
    std::vector<float> values = ramp<float>(g);
    values[7 * 6 * 2 + 7 * 3 + 4] = std::numeric_limits<float>::quiet_NaN();
    for (const char* name : {"nan.nrrd", "nan.tif"}) {
        write_image(scratch.path(name), g, values.data());
        contains(read_error(scratch.path(name)), "got NaN or infinity at voxel (4, 3, 2)");
    }
    CHECK_THROWS_AS(check_image_extension("a.png"), Error);
    CHECK_NOTHROW(check_image_extension("a.nii.gz"));
    CHECK_THROWS_AS(write_image(scratch.path("a.png"), g, values.data()), Error);
}

TEST_CASE("A sheared lattice is read with the positions that the file states") {
    const Scratch scratch;
    const ImageGeometry g = read_image_geometry(
        scratch.write("shear.nrrd",
                      "NRRD0004\ntype: uint8\nencoding: raw\nendian: little\ndimension: 3\nsizes: 2 2 2\n"
                      "space dimension: 3\nspace directions: (1,0,0) (0.5,2,0) (0,-1,3)\nspace origin: (7,8,9)\n\n"
                      "abcdefgh"));
    const Vec3 world = g.index_to_world({1, 1, 1}), index = g.world_to_index({8.5, 9, 12});
    for (int a = 0; a < 3; ++a) {
        CHECK(world[a] == Approx(Vec3{8.5, 9, 12}[a]));
        CHECK(index[a] == Approx(1));
    }
}

TEST_CASE("A fourth dimension of size one is ignored, and from a larger one a frame is selected") {
    const Scratch scratch;
    const std::string header = "NRRD0004\ntype: uint8\nencoding: raw\nendian: little\ndimension: 4\n";
    std::string data;
    for (char c = 0; c < 24; ++c) data += c;
    Image image = read_image(scratch.write("one.nrrd", header + "sizes: 4 3 2 1\n\n" + data));
    CHECK(image.geometry().size == Index3{4, 3, 2});
    CHECK(image.at(3, 2, 1) == 23);
    ReadImageOptions options;
    options.frame = 2;
    image = read_image(scratch.write("three.nrrd", header + "sizes: 2 2 2 3\n\n" + data), options);
    CHECK(image.at(1, 0, 0) == 17);
}

TEST_CASE("Damaged NRRD, NIfTI, MetaImage and TIFF files never crash the reader") {
    const Scratch scratch;
    const ImageGeometry g = oblique();
    const auto read = [](const std::string& path) {
        const Image image = read_image(path);
        (void)image.range();
    };
    for (const char* name : {"f.nrrd", "f.nii", "f.nii.gz", "f.mha", "f.tif"}) {
        INFO(name);
        write_image(scratch.path(name), g, ramp<std::uint8_t>(g).data());
        const FuzzCounts counts = fuzz(scratch, scratch.path(name), read);
        // Some of the truncated files lack only a checksum at their end.
        CHECK(counts.truncated_accepted <= counts.truncated / 20);
    }
    const std::string tiled =
        make_tiff<float>(scratch.path("tiled.tif"), {32, SAMPLEFORMAT_IEEEFP, 1, COMPRESSION_LZW, true, "w8"}, number);
    fuzz(scratch, tiled, read);
}

TEST_CASE("The embryo phantom is read with the spacing stored by Fiji") {
    const char* data = std::getenv("COVOL_DATA");
    if (data == nullptr) {
        WARN("SKIPPED: COVOL_DATA is not set");
        return;
    }
    const Image image = read_image(std::string(data) + "/phantoms/embryo.tif");
    CHECK(image.geometry().size == Index3{512, 512, 58});
    CHECK(image.geometry().spacing == Vec3{0.35, 0.35, 1.0});
    CHECK(image.geometry().unit == "um");
}
