// Tests of files in formats that Debian's Python packages cannot write, and of damaged files of every format.
#include <itkHDF5ImageIO.h>
#include <itkImageIOBase.h>
#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "covol/image.h"
#include "covol/vdb_io.h"
#include "support/scratch.h"

using namespace covol;

namespace {

constexpr Index3 kSize{7, 6, 5};
constexpr Vec3 kSpacing{0.5, 0.75, 2.0}, kOrigin{10, -20, 30};

int value(int i, int j, int k) { return i + 10 * j + 30 * k; }

void check_ramp(const Image& image) {
    REQUIRE(image.geometry().size == kSize);
    for (int a = 0; a < 3; ++a) {
        CHECK(image.geometry().spacing[a] == Approx(kSpacing[a]));
        CHECK(image.geometry().origin[a] == Approx(kOrigin[a]));
    }
    bool same = true;
    for (int k = 0; k < kSize[2]; ++k)
        for (int j = 0; j < kSize[1]; ++j)
            for (int i = 0; i < kSize[0]; ++i) same = same && image.at(i, j, k) == value(i, j, k);
    CHECK(same);
}

/// Writes a number at the position `at`, in little endian.
template <typename T>
void put(std::string& bytes, std::size_t at, T number) {
    if (bytes.size() < at + sizeof(T)) bytes.resize(at + sizeof(T));
    std::memcpy(bytes.data() + at, &number, sizeof(T));
}

std::string mrc(std::int32_t mode) {
    std::string bytes(1024, '\0');
    for (std::size_t a = 0; a < 3; ++a) {
        put(bytes, 4 * a, kSize[a]);
        put(bytes, 28 + 4 * a, kSize[a]);
        put(bytes, 40 + 4 * a, float(kSize[a] * kSpacing[a]));
        put(bytes, 52 + 4 * a, 90.0F);
        put(bytes, 64 + 4 * a, std::int32_t(a) + 1);
        put(bytes, 196 + 4 * a, float(kOrigin[a]));
    }
    put(bytes, 12, mode);
    bytes.replace(208, 4, "MAP ");
    for (int k = 0; k < kSize[2]; ++k)
        for (int j = 0; j < kSize[1]; ++j)
            for (int i = 0; i < kSize[0]; ++i) put(bytes, bytes.size(), std::int16_t(value(i, j, k)));
    return bytes;
}

/// Appends a data element of a DICOM file with explicit value representation (VR), in little endian.
void element(std::string& bytes, std::uint16_t group, std::uint16_t number, const std::string& vr, std::string data) {
    if (data.size() % 2 != 0) data += vr == "UI" ? '\0' : ' ';
    put(bytes, bytes.size(), group);
    put(bytes, bytes.size(), number);
    bytes += vr;
    if (vr == "OW" || vr == "OB") {
        put(bytes, bytes.size(), std::uint16_t(0));
        put(bytes, bytes.size(), std::uint32_t(data.size()));
    } else {
        put(bytes, bytes.size(), std::uint16_t(data.size()));
    }
    bytes += data;
}

std::string word(std::uint16_t n) { return {static_cast<char>(n & 255), static_cast<char>(n >> 8)}; }

/// Slice k of the ramp as a DICOM file, according to PS3.10 and PS3.5 of the standard.
std::string dicom(int k) {
    std::string meta;
    element(meta, 2, 1, "OB", std::string("\0\1", 2));
    element(meta, 2, 2, "UI", "1.2.840.10008.5.1.4.1.1.2");
    element(meta, 2, 3, "UI", "1.2.3." + std::to_string(k + 1));
    element(meta, 2, 0x10, "UI", "1.2.840.10008.1.2.1");
    std::string bytes = std::string(128, '\0') + "DICM", length;
    put(length, 0, std::uint32_t(meta.size()));
    element(bytes, 2, 0, "UL", length);
    bytes += meta;
    element(bytes, 8, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.2");
    element(bytes, 8, 0x18, "UI", "1.2.3." + std::to_string(k + 1));
    element(bytes, 8, 0x60, "CS", "CT");
    element(bytes, 0x20, 0xD, "UI", "1.2.3");
    element(bytes, 0x20, 0xE, "UI", "1.2.3.9");
    element(bytes, 0x20, 0x32, "DS", "10\\-20\\" + std::to_string(30 + 2 * k));
    element(bytes, 0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0");
    element(bytes, 0x28, 2, "US", word(1));
    element(bytes, 0x28, 4, "CS", "MONOCHROME2");
    element(bytes, 0x28, 0x10, "US", word(6));
    element(bytes, 0x28, 0x11, "US", word(7));
    element(bytes, 0x28, 0x30, "DS", "0.75\\0.5");
    element(bytes, 0x28, 0x100, "US", word(16));
    element(bytes, 0x28, 0x101, "US", word(16));
    element(bytes, 0x28, 0x102, "US", word(15));
    element(bytes, 0x28, 0x103, "US", word(0));
    std::string pixels;
    for (int j = 0; j < kSize[1]; ++j)
        for (int i = 0; i < kSize[0]; ++i) pixels += word(static_cast<std::uint16_t>(value(i, j, k)));
    element(bytes, 0x7FE0, 0x10, "OW", pixels);
    return bytes;
}

void write_series(const std::string& folder) {
    std::filesystem::create_directories(folder);
    for (int k = 0; k < kSize[2]; ++k)
        std::ofstream(folder + "/" + std::to_string(9 - k) + ".dcm", std::ios::binary) << dicom(k);
}

void write_hdf5(const std::string& path) {
    const auto io = itk::HDF5ImageIO::New();
    io->SetFileName(path);
    io->SetNumberOfDimensions(3);
    itk::ImageIORegion region(3);
    for (unsigned a = 0; a < 3; ++a) {
        io->SetDimensions(a, itk::SizeValueType(kSize[a]));
        io->SetSpacing(a, kSpacing[a]);
        io->SetOrigin(a, kOrigin[a]);
        std::vector<double> axis(3, 0.0);
        axis[a] = 1;
        io->SetDirection(a, axis);
        region.SetSize(a, itk::SizeValueType(kSize[a]));
    }
    io->SetIORegion(region);
    io->SetNumberOfComponents(1);
    io->SetPixelType(itk::IOPixelEnum::SCALAR);
    io->SetComponentType(itk::IOComponentEnum::SHORT);
    std::vector<std::int16_t> values;
    for (int k = 0; k < kSize[2]; ++k)
        for (int j = 0; j < kSize[1]; ++j)
            for (int i = 0; i < kSize[0]; ++i) values.push_back(std::int16_t(value(i, j, k)));
    io->WriteImageInformation();
    io->Write(values.data());
}

/// Damaged files must neither crash nor be read beyond their end.
void fuzz_image(const Scratch& scratch, const std::string& path) {
    INFO(path);
    const auto read = [](const std::string& bad) {
        ReadImageOptions options;
        options.channel = options.frame = 0;
        const Image image = read_image(bad, options);
        (void)image.range();
    };
    const FuzzCounts counts = fuzz(scratch, path, read, 80, 1024);
    CHECK(counts.truncated_accepted <= counts.truncated / 20);
}

}  // namespace

TEST_CASE("MRC: pixels, spacing, origin, permuted axes and extended headers are read") {
    const Scratch scratch;
    const Image image = read_image(scratch.write("a.mrc", mrc(1)));
    check_ramp(image);
    CHECK(image.pixel_type() == PixelType::Int16);
    CHECK(image.geometry().unit == "angstrom");
    std::string permuted = mrc(1);  // columns along z, rows along x, sections along y
    put(permuted, 64, std::int32_t(3));
    put(permuted, 68, std::int32_t(1));
    put(permuted, 72, std::int32_t(2));
    const ImageGeometry g = read_image_geometry(scratch.write("p.mrc", permuted));
    // A step along the columns is a step along the world's z, by the cell's length in z over the number of samples in
    // z.
    const Vec3 step = g.index_to_world({1, 0, 0});
    CHECK(step[0] == Approx(kOrigin[0]));
    CHECK(step[2] == Approx(kOrigin[2] + kSpacing[2]));
    std::string complex = mrc(4);
    CHECK(message_of([&] { (void)read_image(scratch.write("c.mrc", complex)); }).find("mode 4") != std::string::npos);
    std::string no_cell = mrc(1);
    put(no_cell, 40, 0.0F);
    CHECK_FALSE(read_image_geometry(scratch.write("n.mrc", no_cell)).spacing_known);
    // An extended header lies between the header and the pixels.
    std::string extended = mrc(1);
    put(extended, 92, std::int32_t(80));
    extended.insert(1024, 80, 'x');
    check_ramp(read_image(scratch.write("e.mrc", extended)));
}

TEST_CASE("HDF5 images of ITK are read whole and in part") {
    const Scratch scratch;
    write_hdf5(scratch.path("a.h5"));
    check_ramp(read_image(scratch.path("a.h5")));
    ReadImageOptions options;
    options.roi = WorldBox{{11, -18.5, 34}, {11.5, -18, 34}};
    const Image part = read_image(scratch.path("a.h5"), options);
    CHECK(part.held() == VoxelBox{{1, 1, 1}, {4, 4, 3}});
    CHECK(part.at(3, 2, 2) == value(3, 2, 2));
}

TEST_CASE("A DICOM series, given as a folder or as one of its files, is sorted by position") {
    const Scratch scratch;
    const std::string folder = scratch.path("series");
    write_series(folder);
    check_ramp(read_image(folder));
    check_ramp(read_image(folder + "/7.dcm"));
    CHECK(read_image_geometry(folder).unit == "mm");
    std::ofstream(folder + "/notes.txt") << "not an image";
    check_ramp(read_image(folder));
    std::filesystem::remove(folder + "/7.dcm");
    CHECK(message_of([&] { (void)read_image(folder); }).find("a slice is missing") != std::string::npos);
    std::filesystem::create_directories(scratch.path("empty"));
    CHECK(message_of([&] { (void)read_image(scratch.path("empty")); }).find("neither a usable DICOM image") !=
          std::string::npos);
}

TEST_CASE("A float grid of a .vdb file is read as an image on the box of its active voxels") {
    const Scratch scratch;
    Domain domain;
    domain.voxel_size = 0.5;
    domain.origin = {1, 2, 3};
    domain.max = {3, 3, 3};
    const FloatGridPtr a = make_grid(domain, 7.0F, "a"), b = make_grid(domain, 0.0F, "b");
    write_vdb(scratch.path("empty.vdb"), {a});
    CHECK(message_of([&] { (void)read_image(scratch.path("empty.vdb")); }).find("no active voxel") !=
          std::string::npos);
    CHECK(message_of([&] { (void)read_image(scratch.path("empty.vdb") + ":x"); }).find("x") != std::string::npos);
    a->tree().setValue({1, 0, 2}, 3.0F);
    a->tree().setValue({3, 1, 3}, 4.0F);
    write_vdb(scratch.path("full.vdb"), {b, a});
    const Image image = read_image(scratch.path("full.vdb") + ":a");
    CHECK(image.geometry().size == Index3{3, 2, 2});
    CHECK(image.geometry().spacing == Vec3{0.5, 0.5, 0.5});
    CHECK(image.geometry().origin == Vec3{1.5, 2, 4});
    CHECK(image.at(0, 0, 0) == 3);
    CHECK(image.at(2, 1, 1) == 4);
    CHECK(image.at(1, 0, 0) == 7);  // the background
}

TEST_CASE("Damaged MRC and DICOM files never crash the reader") {
    const Scratch scratch;
    fuzz_image(scratch, scratch.write("f.mrc", mrc(1)));
    const std::string slice = dicom(0);
    // The file is the only slice of its series, which is an Error anyway. The test is that reading ends.
    fuzz(
        scratch, scratch.write("d.dcm", slice), [](const std::string& bad) { (void)read_image(bad); }, 200,
        slice.size());
    const std::string folder = scratch.path("series");
    write_series(folder);
    fuzz(
        scratch, folder + "/9.dcm",
        [&](const std::string& bad) {
            std::filesystem::copy_file(bad, folder + "/9.dcm", std::filesystem::copy_options::overwrite_existing);
            (void)read_image(folder);
        },
        60, slice.size() - 84);
}

TEST_CASE("MRC headers of size 0 are rejected, and a DICOM slice of 0 bits counts as missing") {
    const Scratch scratch;
    for (std::size_t a = 0; a < 3; ++a) {
        std::string flat = mrc(1);
        put(flat, 4 * a, std::int32_t(0));
        CHECK_THAT(message_of([&] { (void)read_image(scratch.write("f.mrc", flat)); }), Catch::Contains("MRC"));
    }
    std::string slice = dicom(2), stored, high;
    element(stored, 0x28, 0x101, "US", word(16));
    element(high, 0x28, 0x102, "US", word(15));
    slice.erase(slice.find(high), high.size());
    slice.replace(slice.find(stored) + 8, 2, word(0));
    const std::string folder = scratch.path("series");
    write_series(folder);
    CHECK(message_of([&] { (void)read_image(folder); }).empty());
    std::ofstream(folder + "/7.dcm", std::ios::binary) << slice;  // a slice whose values have 0 bits, which is skipped
    CHECK_THAT(message_of([&] { (void)read_image(folder); }), Catch::Contains("a slice is missing"));
}

TEST_CASE("A damaged slice at the end of a DICOM series is skipped with a warning") {
    const Scratch scratch;
    const std::string folder = scratch.path("series");
    write_series(folder);
    std::filesystem::resize_file(folder + "/9.dcm", 200);  // the lowest slice
    std::vector<std::string> warnings;
    RunContext run;
    run.log = [&](LogLevel level, const std::string& line) {
        if (level == LogLevel::Warning) warnings.push_back(line);
    };
    CHECK(read_image(folder, {}, run).geometry().size[2] == kSize[2] - 1);
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], Catch::Contains("9.dcm") && Catch::Contains("skipped"));
}

TEST_CASE("Damaged HDF5 files never crash the reader", "[hdf5]") {
    const Scratch scratch;
    write_hdf5(scratch.path("f.h5"));
    fuzz_image(scratch, scratch.path("f.h5"));
}
