// Files in the layouts of Imaris, BigDataViewer and ilastik, written by the HDF5 library itself.
#include <hdf5.h>
#include <zstd.h>

#include <array>
#include <catch2/catch.hpp>
#include <numeric>

#include "covol/image.h"
#include "support/scratch.h"

using namespace covol;

namespace {

constexpr Index3 kSize{6, 5, 4};
constexpr std::array<hsize_t, 3> kShape{4, 5, 6}, kChunk{2, 2, 4};

/// The voxels of an image, i fastest, with values that count up from `first`.
std::vector<std::uint16_t> ramp(const std::vector<hsize_t>& shape, std::uint16_t first = 0) {
    const auto count = std::accumulate(shape.begin(), shape.end(), hsize_t(1), std::multiplies<>());
    std::vector<std::uint16_t> values(static_cast<std::size_t>(count));
    std::iota(values.begin(), values.end(), first);
    return values;
}

/// Writes an HDF5 file; groups are created as needed.
class Writer {
public:
    explicit Writer(const std::string& path)
        : file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)), links_(H5Pcreate(H5P_LINK_CREATE)) {
        H5Pset_create_intermediate_group(links_, 1);
    }
    ~Writer() {
        H5Pclose(links_);
        H5Fclose(file_);
    }
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;

    [[nodiscard]] hid_t id() const { return file_; }

    /// `edit` changes the properties with which the dataset is created. If `values` is empty, no data is written.
    template <typename T>
    void dataset(
        const std::string& name, const std::vector<hsize_t>& shape, hid_t type, const std::vector<T>& values,
        const std::function<void(hid_t)>& edit = [](hid_t) {}) const {
        const hid_t space = H5Screate_simple(int(shape.size()), shape.data(), nullptr);
        const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
        edit(properties);
        const hid_t data = H5Dcreate2(file_, name.c_str(), type, space, links_, properties, H5P_DEFAULT);
        REQUIRE(data >= 0);
        if (!values.empty()) REQUIRE(H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
        H5Dclose(data);
        H5Pclose(properties);
        H5Sclose(space);
    }
    void image(const std::string& name, std::uint16_t first = 0,
               const std::vector<hsize_t>& shape = {kShape.begin(), kShape.end()}) const {
        dataset(name, shape, H5T_STD_U16LE, ramp(shape, first));
    }
    void group(const std::string& name) const {
        H5Gclose(H5Gcreate2(file_, name.c_str(), links_, H5P_DEFAULT, H5P_DEFAULT));
    }
    /// Writes a text attribute as one string or, if `letters`, as in Imaris files: one character per element.
    void text(const std::string& object, const std::string& name, const std::string& value, bool letters) const {
        const hid_t type = H5Tcopy(H5T_C_S1);
        const hsize_t count = letters ? value.size() : 1;
        if (!letters) H5Tset_size(type, value.size());
        attribute(object, name, type, count, value.data());
        H5Tclose(type);
    }
    void numbers(const std::string& object, const std::string& name, const std::vector<double>& values) const {
        attribute(object, name, H5T_IEEE_F64LE, values.size(), values.data());
    }

private:
    void attribute(const std::string& object, const std::string& name, hid_t type, hsize_t count,
                   const void* values) const {
        const hid_t space = H5Screate_simple(1, &count, nullptr);
        const hid_t made =
            H5Acreate_by_name(file_, object.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        REQUIRE(made >= 0);
        H5Awrite(made, type, values);
        H5Aclose(made);
        H5Sclose(space);
    }

    hid_t file_, links_;
};

/// Checks that the image is the ramp that starts at `first`.
void check_ramp(const std::string& path, int first, const ReadImageOptions& options = {}) {
    INFO(path);
    const Image image = read_image(path, options);
    const Index3 size = image.geometry().size;
    bool same = true;
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i)
                same = same && image.at(i, j, k) == first + i + size[0] * (j + size[1] * k);
    CHECK(same);
}

void is_refused(const std::string& path, const std::string& part) {
    CHECK_THAT(message_of([&] { (void)read_image(path); }), Catch::Contains(part));
}

std::function<void(hid_t)> in_chunks(const std::function<void(hid_t)>& filters = [](hid_t) {}) {
    return [filters](hid_t properties) {
        H5Pset_chunk(properties, 3, kChunk.data());
        filters(properties);
    };
}

std::string imaris(const Scratch& scratch) {
    const std::string path = scratch.path("a.ims");
    const Writer file(path);
    file.group("/DataSetInfo/Image");
    for (int a = 0; a < 3; ++a) {
        file.text("/DataSetInfo/Image", "ExtMin" + std::to_string(a), std::to_string(10 * a), true);
        file.text("/DataSetInfo/Image", "ExtMax" + std::to_string(a), std::to_string(10 * a + kSize[a]), true);
    }
    file.text("/DataSetInfo/Image", "Unit", "um", true);
    for (int level = 0; level < 2; ++level)
        for (int channel = 0; channel < 2; ++channel) {
            const std::string group =
                "/DataSet/ResolutionLevel " + std::to_string(level) + "/TimePoint 0/Channel " + std::to_string(channel);
            // The dataset may be padded to whole chunks. The size of the image is given by the attributes ImageSizeX, Y
            // and Z.
            file.image(group + "/Data", std::uint16_t(1000 * channel + 100 * level),
                       level == 0 ? std::vector<hsize_t>{4, 5, 6} : std::vector<hsize_t>{2, 2, 3});
            for (int a = 0; a < 3; ++a)
                file.text(group, std::string("ImageSize") + "XYZ"[a],
                          std::to_string(level == 0 ? kSize[a] : kSize[a] / 2), true);
            if (level == 0) {
                file.group("/DataSetInfo/Channel " + std::to_string(channel));
                file.text("/DataSetInfo/Channel " + std::to_string(channel), "Name", channel == 0 ? "red" : "green",
                          true);
            }
        }
    return path;
}

std::string big_data_viewer(const Scratch& scratch) {
    const std::string path = scratch.path("b.h5");
    const Writer file(path);
    for (const char* setup : {"s00", "s01"}) {
        file.dataset<double>(std::string("/") + setup + "/resolutions", {2, 3}, H5T_IEEE_F64LE, {1, 1, 1, 2, 2, 2});
        const int first = setup[2] == '1' ? 1000 : 0;
        file.image(std::string("/t00000/") + setup + "/0/cells", std::uint16_t(first));
        file.image(std::string("/t00000/") + setup + "/1/cells", std::uint16_t(first + 100), {2, 2, 3});
    }
    scratch.write(
        "b.xml",
        "<SpimData><ViewSetup><id>0</id><name>near</name><voxelSize><unit>micron</unit><size>0.5 0.5 2</size>"
        "</voxelSize></ViewSetup><ViewSetup><id>1</id><name>far</name><voxelSize><unit>micron</unit><size>0.5 "
        "0.5 2</size></voxelSize></ViewSetup></SpimData>");
    return path;
}

}  // namespace

TEST_CASE("Imaris: levels, channels, extent and names", "[hdf5]") {
    const Scratch scratch;
    const std::string path = imaris(scratch);
    const ImageInfo info = read_image_info(path);
    CHECK(info.format == "Imaris");
    CHECK(info.geometry.size == kSize);
    CHECK(info.geometry.spacing == Vec3{1, 1, 1});
    CHECK(info.geometry.origin == Vec3{0.5, 10.5, 20.5});  // ExtMin is the outer corner of the first voxel
    CHECK(info.geometry.unit == "um");
    CHECK(info.channel_names == std::vector<std::string>{"red", "green"});
    CHECK(info.levels.size() == 2);
    is_refused(path, "0 (red), 1 (green)");
    ReadImageOptions options;
    options.channel = 1;
    check_ramp(path, 1000, options);
    const std::string coarse = path + ":/DataSet/ResolutionLevel 1";
    CHECK(read_image_geometry(coarse, options).spacing == Vec3{2, 2, 2});
    check_ramp(coarse, 1100, options);
    check_ramp(coarse + "/TimePoint 0/Channel 0/Data", 100);
    is_refused(path + ":/DataSet/ResolutionLevel 9", "no such dataset");
}

TEST_CASE("BigDataViewer: setups, levels, and voxel sizes from the XML file beside it", "[hdf5]") {
    const Scratch scratch;
    const std::string path = big_data_viewer(scratch);
    const ImageInfo info = read_image_info(path);
    CHECK(info.format == "BigDataViewer HDF5");
    CHECK(info.geometry.size == kSize);
    CHECK(info.geometry.spacing == Vec3{0.5, 0.5, 2});
    CHECK(info.geometry.unit == "um");
    CHECK(info.channel_names == std::vector<std::string>{"near", "far"});
    CHECK(info.levels.size() == 2);
    ReadImageOptions options;
    options.channel = 1;
    check_ramp(path, 1000, options);
    check_ramp(path + ":/t00000/s00", 0);
    check_ramp(path + ":/t00000/s01/1", 1100);
    const ImageGeometry coarse = read_image_geometry(path + ":/t00000/s01/1/cells");
    CHECK(coarse.spacing == Vec3{1, 1, 4});
    CHECK(coarse.origin == Vec3{0.25, 0.25, 1});  // coarse voxels are means of two voxels along each axis
    is_refused(path + ":/t00000/s00/2", "no such dataset");
    scratch.write("b.xml", "<SpimData><ViewSetup><id>0</id><voxelSize><size>1 1</size></voxelSize></ViewSetup>");
    CHECK(read_image_info(path).spacing_known == std::array<bool, 3>{false, false, false});
}

TEST_CASE("HDF5 datasets: all types, layouts and filters are read, and missing chunks have the fill value", "[hdf5]") {
    const Scratch scratch;
    const std::string path = scratch.path("a.h5");
    const std::vector<hsize_t> shape{kShape.begin(), kShape.end()};
    const auto with = [](auto call) { return in_chunks(call); };
    const std::vector<std::pair<std::string, std::function<void(hid_t)>>> kinds{
        {"whole", [](hid_t) {}},
        {"compact", [](hid_t properties) { H5Pset_layout(properties, H5D_COMPACT); }},
        {"chunks", in_chunks()},
        {"gzip", with([](hid_t properties) { H5Pset_deflate(properties, 4); })},
        {"shuffled", with([](hid_t properties) {
             H5Pset_shuffle(properties);
             H5Pset_deflate(properties, 4);
         })},
        {"checked", with([](hid_t properties) { H5Pset_fletcher32(properties); })},
        {"offset", with([](hid_t properties) { H5Pset_scaleoffset(properties, H5Z_SO_INT, 0); })},
    };
    {
        const Writer file(path);
        for (const auto& [name, edit] : kinds) file.dataset(name, shape, H5T_STD_U16LE, ramp(shape), edit);
        for (const auto& [name, type] :
             {std::pair("be16", H5T_STD_U16BE), std::pair("be32", H5T_STD_I32BE), std::pair("be64", H5T_STD_U64BE),
              std::pair("f32", H5T_IEEE_F32BE), std::pair("f64", H5T_IEEE_F64LE)}) {
            const hid_t space = H5Screate_simple(3, shape.data(), nullptr);
            const hid_t data = H5Dcreate2(file.id(), name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
            H5Dwrite(data, H5T_NATIVE_UINT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, ramp(shape).data());
            H5Dclose(data);
            H5Sclose(space);
        }
        const std::uint16_t seven = 7;
        file.dataset<std::uint16_t>("missing", shape, H5T_STD_U16LE, {}, in_chunks([&](hid_t properties) {
                                        H5Pset_fill_value(properties, H5T_STD_U16LE, &seven);
                                    }));
    }
    for (const auto& [name, edit] : kinds) check_ramp(path + ":/" + name, 0);
    for (const char* name : {"be16", "be32", "be64", "f32", "f64"}) check_ramp(path + ":/" + name, 0);
    CHECK(read_image(path + ":/missing").range() == std::array<double, 2>{7, 7});
    CHECK(read_image_info(path + ":/gzip").chunk_size == Index3{4, 2, 2});
}

TEST_CASE("HDF5 datasets: a damaged chunk index is an error, and its chunks are not taken for missing ones", "[hdf5]") {
    const Scratch scratch;
    const std::string path = scratch.path("a.h5");
    const std::vector<hsize_t> shape{kShape.begin(), kShape.end()};
    {
        const Writer file(path);
        file.dataset("a", shape, H5T_STD_U16LE, ramp(shape),
                     in_chunks([](hid_t properties) { H5Pset_deflate(properties, 4); }));
    }
    check_ramp(path, 0);
    std::string bytes = bytes_of(path);
    const std::size_t node =
        bytes.find(std::string("TREE\1", 5));  // a node of chunks; nodes of groups have a 0 instead of the 1
    REQUIRE(node != std::string::npos);
    bytes[node] = 'F';
    scratch.write("b.h5", bytes);
    is_refused(scratch.path("b.h5"), "the index of its chunks cannot be read");
}

TEST_CASE("HDF5 datasets: LZ4, LZF and Zstandard are decoded, damaged chunks and other filters are rejected",
          "[hdf5]") {
    const Scratch scratch;
    const std::string path = scratch.path("a.h5");
    const std::vector<hsize_t> shape{2, 2, 4};  // one chunk
    const std::vector<std::uint16_t> values = ramp(shape);
    const auto bytes = std::string(reinterpret_cast<const char*>(values.data()), 2 * values.size());
    // In the format of the LZ4 filter, sizes are big endian, and a block whose compressed size equals its size is
    // stored uncompressed.
    const std::string lz4 = std::string("\0\0\0\0\0\0\0\x20\0\0\0\x20\0\0\0\x20", 16) + bytes;
    const std::string lzf = std::string(1, char(31)) + bytes;  // one run of 32 literals
    std::string zstd(ZSTD_compressBound(bytes.size()), '\0');
    zstd.resize(ZSTD_compress(zstd.data(), zstd.size(), bytes.data(), bytes.size(), 1));
    const std::vector<std::tuple<std::string, int, std::string>> packed{
        {"lz4", 32004, lz4},
        {"lzf", 32000, lzf},
        {"zstd", 32015, zstd},
        {"short", 32004, lz4.substr(0, 20)},
        {"wild", 32000, std::string("\x20\xff", 2)},  // refers to bytes before the output
        {"bitshuffle", 32008, bytes}};
    {
        const Writer file(path);
        for (const auto& [name, filter, content] : packed) {
            file.dataset<std::uint16_t>(name, shape, H5T_STD_U16LE, {}, [filter = filter](hid_t properties) {
                H5Pset_chunk(properties, 3, kChunk.data());
                H5Pset_filter(properties, filter, H5Z_FLAG_OPTIONAL, 0, nullptr);
            });
            const hid_t data = H5Dopen2(file.id(), name.c_str(), H5P_DEFAULT);
            const std::array<hsize_t, 3> first{0, 0, 0};
            H5Dwrite_chunk(data, H5P_DEFAULT, 0, first.data(), content.size(), content.data());
            H5Dclose(data);
        }
    }
    for (const char* name : {"lz4", "lzf", "zstd"}) check_ramp(path + ":/" + name, 0);
    is_refused(path + ":/short", "not valid LZ4 data");
    is_refused(path + ":/wild", "not valid LZF data");
    is_refused(path + ":/bitshuffle", "filter 32008");
}

TEST_CASE("HDF5 datasets: axes and spacing are read from the attributes of several programs", "[hdf5]") {
    const Scratch scratch;
    const std::string path = scratch.path("a.h5");
    const auto tags = [](const std::string& order) {
        std::string text = R"({"axes": [)";
        for (std::size_t n = 0; n < order.size(); ++n)
            text += (n == 0 ? "" : ", ") + std::string(R"({"key": ")") + order[n] + R"(", "resolution": 0.25})";
        return text + "]}";
    };
    {
        const Writer file(path);
        file.image("series", 0, {2, 4, 5, 6});
        file.text("series", "axistags", tags("tzyx"), false);
        file.image("ones", 0, {1, 4, 5, 6, 1});
        file.image("unknown", 0, {2, 4, 5, 6});
        file.image("twice");
        file.text("twice", "axistags", tags("zyy"), false);
        file.image("few");
        file.text("few", "axistags", tags("zy"), false);
        file.image("element");
        file.numbers("element", "element_size_um", {3, 2, 1});
        file.image("plain");
        file.numbers("plain", "spacing", {3, 2, 1});
        file.text("plain", "unit", "mm", false);
        file.image("odd");
        file.numbers("odd", "spacing", {3, -2, std::numeric_limits<double>::quiet_NaN()});
    }
    ReadImageOptions options;
    options.frame = 1;
    check_ramp(path + ":/series", 4 * 5 * 6, options);
    CHECK(read_image_geometry(path + ":/series", options).spacing == Vec3{0.25, 0.25, 0.25});
    check_ramp(path + ":/ones", 0);
    is_refused(path + ":/unknown", "got a dataset of 2 x 4 x 5 x 6 without it");
    is_refused(path + ":/twice", "expected axes z, y and x");
    is_refused(path + ":/few", "for each of its 3 dimensions");
    CHECK(read_image_geometry(path + ":/element").spacing == Vec3{1, 2, 3});
    CHECK(read_image_geometry(path + ":/element").unit == "um");
    CHECK(read_image_geometry(path + ":/plain").unit == "mm");
    CHECK_FALSE(read_image_geometry(path + ":/odd").spacing_known);
}

TEST_CASE("HDF5 datasets: a single one is found, several are listed, and anything but an image is rejected", "[hdf5]") {
    const Scratch scratch;
    const std::string path = scratch.path("a.h5");
    const std::vector<hsize_t> shape{kShape.begin(), kShape.end()};
    {
        const Writer file(path);
        file.image("volume/data");
        file.dataset<double>("table", {3, 4}, H5T_IEEE_F64LE, std::vector<double>(12));
    }
    check_ramp(path, 0);
    check_ramp(path + ":volume", 0);
    is_refused(path + ":/none", "no such dataset");
    is_refused(path + ":/table", "got a dataset of 3 x 4");
    {
        const Writer file(path);
        file.image("one");
        file.image("two");
        const hid_t complex = H5Tcreate(H5T_COMPOUND, 4);
        H5Tinsert(complex, "r", 0, H5T_STD_U16LE);
        H5Tinsert(complex, "i", 2, H5T_STD_U16LE);
        file.dataset<std::uint32_t>("complex", shape, complex, {});
        H5Tclose(complex);
        H5Lcreate_external("b.h5", "/data", file.id(), "external", H5P_DEFAULT, H5P_DEFAULT);
        file.dataset<std::uint16_t>("empty", {0, 5, 6}, H5T_STD_U16LE, {});
    }
    is_refused(path, "/one (4 x 5 x 6), /two (4 x 5 x 6)");
    is_refused(path + ":/complex", "records of several values");
    is_refused(path + ":/external", "is a link into another file");
    is_refused(path + ":/empty", "expected a 3D image");
    { const Writer file(path); }
    is_refused(path, "got none");
    scratch.write("no.h5", "this is text");
    is_refused(scratch.path("no.h5"), "no.h5");
}
