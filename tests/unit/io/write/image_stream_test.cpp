#include "covol/image_stream.h"

#include <tiffio.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "covol/error.h"
#include "files/atomic.h"
#include "io/write/image_writers.h"
#include "io/write/pixel_blocks.h"
#include "io/write/zarr_levels.h"
#include "support/scratch.h"

using namespace covol;
namespace fs = std::filesystem;

namespace {

/// Labels of a ball: 7, and 2 in its core, times `scale`; 0 elsewhere. The ball fills 90 % of the shortest side of the
/// image. Boxes in the core, or outside of the ball, are reported as uniform.
template <typename T>
class Balls : public PixelSource {
public:
    Balls(const ImageGeometry& geometry, PixelType type, bool labels, int scale = 1)
        : PixelSource(geometry, type, labels), scale_(scale) {
        for (int a = 0; a < 3; ++a) radius_ = std::min(radius_, 0.45 * geometry.size[a]);
    }
    [[nodiscard]] double radius_of(int i, int j, int k) const {
        const Index3 at{i, j, k};
        double sum = 0;
        for (int a = 0; a < 3; ++a) sum += std::pow(at[a] - 0.5 * (geometry().size[a] - 1), 2);
        return std::sqrt(sum);
    }
    [[nodiscard]] T value(int i, int j, int k) const {
        const double r = radius_of(i, j, k);
        return static_cast<T>(scale_ * (r < 0.7 * radius_ ? 2 : r < radius_ ? 7 : 0));
    }
    void fill(const VoxelBox& box, void* out) const override {
        auto* next = static_cast<T*>(out);
        for (int k = box.min[2]; k <= box.max[2]; ++k)
            for (int j = box.min[1]; j <= box.max[1]; ++j)
                for (int i = box.min[0]; i <= box.max[0]; ++i) *next++ = value(i, j, k);
    }
    [[nodiscard]] std::optional<double> uniform(const VoxelBox& box) const override {
        const T first = value(box.min[0], box.min[1], box.min[2]);
        for (int k = box.min[2]; k <= box.max[2]; ++k)
            for (int j = box.min[1]; j <= box.max[1]; ++j)
                for (int i = box.min[0]; i <= box.max[0]; ++i)
                    if (value(i, j, k) != first) return std::nullopt;
        return double(first);
    }
    void wrote(const VoxelBox& box, const void* values, double uniform) const override {
        const Index3 n = box.size();
        voxels += std::uint64_t(n[0]) * n[1] * n[2];
        if (values == nullptr && this->uniform(box) != uniform) wrong = true;
    }
    mutable std::atomic<std::uint64_t> voxels = 0;
    mutable std::atomic<bool> wrong = false;

private:
    double radius_ = 1e9;
    int scale_;
};

ImageGeometry lattice(const Index3& size) {
    ImageGeometry g;
    g.size = size;
    g.spacing = {0.5, 0.625, 1.25};
    g.origin = {10, -20, 5.5};
    g.unit = "um";
    return g;
}

template <typename T>
void check_read(const std::string& path, const Balls<T>& source) {
    const Image image = read_image(path);
    REQUIRE(image.geometry().size == source.geometry().size);
    CHECK(image.pixel_type() == source.type());
    const Index3 n = source.geometry().size;
    std::uint64_t different = 0;
    for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
            for (int i = 0; i < n[0]; ++i) different += image.at(i, j, k) == double(source.value(i, j, k)) ? 0 : 1;
    CHECK(different == 0);
    for (int a = 0; a < 3; ++a) {
        CHECK(image.geometry().spacing[a] == Approx(source.geometry().spacing[a]));
        CHECK(image.geometry().origin[a] == Approx(source.geometry().origin[a]));
    }
}

nlohmann::json json_of(const std::string& path) { return nlohmann::json::parse(bytes_of(path)); }

/// All files below a folder, by name.
std::map<std::string, std::string> files_of(const std::string& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file()) files[fs::relative(entry, folder).string()] = bytes_of(entry.path().string());
    return files;
}

}  // namespace

TEST_CASE("Streamed images are read back exactly, and each written voxel is reported once") {
    const Scratch scratch;
    // The first image has several blocks of 256 KB, the second image has only one. Their sizes are not multiples of a
    // tile, chunk or block.
    for (const Index3& size : {Index3{301, 290, 31}, Index3{23, 5, 9}}) {
        const ImageGeometry g = lattice(size);
        const Balls<std::uint8_t> bytes(g, PixelType::UInt8, true);
        const Balls<std::int32_t> wide(g, PixelType::Int32, true, -70000);
        const Balls<float> grey(g, PixelType::Float, false);
        std::uint64_t times = 0;
        for (const char* name : {"a.nrrd", "a.mha", "a.nii", "a.nii.gz", "a.tif", "a.ome.zarr", "a.zarr/"}) {
            INFO(name << " of " << size[0]);
            const std::string path = scratch.path(name);
            for (const bool pack : {true, false}) {
                write_image(path, bytes, {pack});
                check_read(path, bytes);
                ++times;
            }
            write_image(path, wide);
            check_read(path, wide);
            write_image(path, grey);
            check_read(path, grey);
        }
        CHECK(bytes.voxels == times * std::uint64_t(size[0]) * size[1] * size[2]);
        CHECK_FALSE(bytes.wrong);
    }
}

TEST_CASE("Streamed files are identical for 1 and 8 threads") {
    const Scratch scratch;
    const Balls<std::uint8_t> source(lattice({301, 290, 31}), PixelType::UInt8, true);
    RunContext one, eight;
    one.threads = 1;
    eight.threads = 8;
    for (const char* name : {"a.nrrd", "a.mha", "a.nii.gz", "a.tif"}) {
        INFO(name);
        write_image(scratch.path(name), source, {}, one);
        const std::string first = bytes_of(scratch.path(name));
        write_image(scratch.path(name), source, {}, eight);
        CHECK(first == bytes_of(scratch.path(name)));
    }
    write_image(scratch.path("a.zarr"), source, {}, one);
    write_image(scratch.path("b.zarr"), source, {}, eight);
    auto a = files_of(scratch.path("a.zarr")), b = files_of(scratch.path("b.zarr"));
    a.erase(".zattrs");  // it contains the file's name
    b.erase(".zattrs");
    CHECK(a == b);
}

TEST_CASE("A BigTIFF is written in tiles, a classic TIFF in strips") {
    const Scratch scratch;
    const Balls<std::uint8_t> source(lattice({301, 290, 5}), PixelType::UInt8, true);
    const std::string path = scratch.path("a.tif");
    for (const bool big : {false, true}) {
        detail::write_tiff(path, source, false, {}, big ? 0 : detail::kClassicTiff);
        check_read(path, source);
        CHECK(bytes_of(path)[2] == (big ? 43 : 42));
        TIFF* tiff = TIFFOpen(path.c_str(), "r");
        REQUIRE(tiff != nullptr);
        CHECK(bool(TIFFIsTiled(tiff)) == big);
        TIFFClose(tiff);
    }
}

TEST_CASE("OME-Zarr: levels hold the most frequent label, empty chunks are omitted, colours and names are written") {
    class Named : public Balls<std::uint8_t> {
    public:
        using Balls::Balls;
        [[nodiscard]] std::vector<NamedLabel> label_names() const override {
            return {{7, "wall", {1, 2, 3}}, {2, "core"}};
        }
    };
    const Scratch scratch;
    const Named source(lattice({301, 290, 140}), PixelType::UInt8, true);
    const std::string path = scratch.path("a.zarr");
    write_image(path, source);
    const auto json = json_of(path + "/.zattrs");
    const auto& levels = json["multiscales"][0]["datasets"];
    // Voxels are 2.5 times as wide along z as along x, so z is not reduced until the other axes have reached this
    // width.
    REQUIRE(levels.size() == 3);
    CHECK(json_of(path + "/1/.zarray")["shape"] == std::vector<int>{140, 145, 151});
    CHECK(json_of(path + "/2/.zarray")["shape"] == std::vector<int>{70, 73, 76});
    CHECK(levels[1]["coordinateTransformations"][0]["scale"] == std::vector<double>{1.25, 1.25, 1.0});
    CHECK(levels[1]["coordinateTransformations"][1]["translation"] == std::vector<double>{5.5, -20 + 0.3125, 10.25});
    CHECK(json["multiscales"][0]["axes"][0]["unit"] == "micrometer");
    CHECK(json["multiscales"][0]["type"] == "mode");
    CHECK(json["image-label"]["colors"][0]["rgba"] == std::vector<int>{1, 2, 3, 255});
    CHECK(json["image-label"]["properties"][1]["name"] == "core");
    CHECK_FALSE(fs::exists(path + "/0/0/0/2"));  // a chunk outside of the ball is not written
    CHECK(fs::exists(path + "/0/0/1/1"));

    const Image coarse = read_image(path + "/1");
    std::uint64_t different = 0;
    for (int k = 0; k < 140; ++k)
        for (int j = 0; j < 145; ++j)
            for (int i = 0; i < 151; ++i) {
                std::map<int, int> times;
                for (int y = 2 * j; y < std::min(2 * j + 2, 290); ++y)
                    for (int x = 2 * i; x < std::min(2 * i + 2, 301); ++x) ++times[source.value(x, y, k)];
                int maximum = 0;
                for (const auto& [value, count] : times) maximum = std::max(maximum, count);
                different += times[int(coarse.at(i, j, k))] == maximum ? 0 : 1;
            }
    CHECK(different == 0);
}

TEST_CASE("Coarse levels are means of grey values, but the most frequent value of labels") {
    const std::array<std::uint8_t, 8> fine{0, 9, 9, 9, 4, 4, 4, 0};
    std::uint8_t coarse = 0;
    detail::coarsen(PixelType::UInt8, true, {2, 2, 2}, fine.data(), {2, 2, 2}, &coarse, {0, 0, 0}, {1, 1, 1});
    CHECK(coarse == 9);
    detail::coarsen(PixelType::UInt8, false, {2, 2, 2}, fine.data(), {2, 2, 2}, &coarse, {0, 0, 0}, {1, 1, 1});
    CHECK(coarse == 5);
}

TEST_CASE("Writing a Zarr store replaces an existing store, but no other folder") {
    const Scratch scratch;
    const Balls<std::uint8_t> source(lattice({20, 20, 20}), PixelType::UInt8, true);
    const std::string path = scratch.path("a.zarr");
    write_image(path, source);
    std::ofstream(path + "/stale") << "x";
    write_image(path, source);
    CHECK_FALSE(fs::exists(path + "/stale"));
    check_read(path, source);

    const std::string own = scratch.path("papers.zarr");
    fs::create_directory(own);
    std::ofstream(own + "/thesis.txt") << "x";
    CHECK_THROWS_WITH(write_image(own, source), Catch::Contains("cannot write"));
    CHECK(fs::exists(own + "/thesis.txt"));
    CHECK_THROWS_WITH(write_image(scratch.path("no/a.zarr"), source), Catch::Contains("does not exist"));
    CHECK(scratch.file_count() == 2);
}

TEST_CASE("A failed write creates no file, and leaves an existing file unchanged") {
    class Breaking : public Balls<std::uint8_t> {
    public:
        using Balls::Balls;
        void fill(const VoxelBox& box, void* out) const override {
            if (box.max[2] > 20) throw Error(Errc::Numerical, "broken");
            Balls::fill(box, out);
        }
    };
    const Scratch scratch;
    const ImageGeometry g = lattice({150, 150, 31});
    const Breaking source(g, PixelType::UInt8, true);
    const Balls<std::uint8_t> whole(g, PixelType::UInt8, true);
    for (const char* name : {"a.nrrd", "a.mha", "a.nii", "a.nii.gz", "a.tif", "a.zarr"}) {
        INFO(name);
        const Scratch fresh;
        const std::string path = fresh.path(name);
        CHECK_THROWS_WITH(write_image(path, source), "broken");
        CHECK(fresh.file_count() == 0);
        write_image(path, whole);
        CHECK_THROWS_WITH(write_image(path, source), "broken");
        CHECK(fresh.file_count() == 1);
        check_read(path, whole);
    }
}

TEST_CASE("NRRD metadata that becomes shorter is padded, and NIfTI rejects more than 32767 voxels per axis") {
    class Shrinking : public Balls<std::uint8_t> {
    public:
        using Balls::Balls;
        [[nodiscard]] std::vector<std::pair<std::string, std::string>> metadata() const override {
            return {{"extent", voxels == 0 ? "100 100" : "1 \\ 2"}, {"name", "a\nb"}};
        }
    };
    const Scratch scratch;
    const Shrinking source(lattice({20, 21, 22}), PixelType::UInt8, true);
    write_image(scratch.path("a.nrrd"), source);
    check_read(scratch.path("a.nrrd"), source);
    const std::string text = bytes_of(scratch.path("a.nrrd"));
    CHECK_THAT(text, Catch::Contains("\nextent:=1 \\\\ 2\n") && Catch::Contains("\nname:=a\\nb\n"));
    const Balls<std::uint8_t> wide(lattice({40000, 1, 1}), PixelType::UInt8, true);
    CHECK_THROWS_WITH(write_image(scratch.path("a.nii"), wide), Catch::Contains("at most 32767"));
    CHECK(scratch.file_count() == 1);
}

TEST_CASE("pad_rows moves voxels to their places in a larger lattice, and fills the others with 0") {
    std::vector<std::uint8_t> values{1, 2, 3, 4, 5, 6, 7, 8};
    values.resize(3 * 3 * 3, 0);
    detail::pad_rows({2, 2, 2}, {3, 3, 3}, 1, reinterpret_cast<char*>(values.data()));
    const std::vector<std::uint8_t> expected{1, 2, 0, 3, 4, 0, 0, 0, 0, 5, 6, 0, 7, 8,
                                             0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    CHECK(values == expected);
}

TEST_CASE("Errors of a writer name the output, not the temporary file or folder") {
    const Scratch scratch;
    const std::string path = scratch.path("a.nrrd");
    const auto refuse = [](const std::string& temporary) { throw Error(Errc::Io, temporary + ": cannot write"); };
    CHECK_THROWS_WITH(detail::write_atomically(path, refuse), path + ": cannot write");
    CHECK_THROWS_WITH(detail::write_folder_atomically(path, false, refuse), path + ": cannot write");
}
