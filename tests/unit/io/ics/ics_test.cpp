// Tests of Image Cytometry Standard files, which are built here byte by byte as libics writes them.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <utility>

#include "covol/image.h"
#include "covol/image_files.h"
#include "support/deflated.h"
#include "support/scratch.h"

using namespace covol;

namespace {

constexpr Index3 kSize{4, 3, 2};
constexpr int kVoxels = 24;

/// A header, as lines of words separated by blanks; blanks become tabs in the file.
struct Header {
    std::string version = "2.0", order = "bits x y z", sizes = "16 4 3 2", format = "integer", sign = "unsigned",
                bytes = "1 2", compression = "uncompressed", scale = "1 0.5 0.25 2000",
                units = "bits micrometers micrometers nanometers", origin = "0 10 -20 3000";
    std::string more;        ///< further lines
    std::string parameters;  ///< the word after "layout parameters"; empty: the number of axes

    [[nodiscard]] std::string count() const {
        return parameters.empty() ? std::to_string(1 + std::count(order.begin(), order.end(), ' ')) : parameters;
    }
    [[nodiscard]] std::string text(const std::string& separators = "\t\n") const {
        std::string lines = "ics_version " + version + "\nfilename ball\nlayout parameters " + count() +
                            "\nlayout order " + order + "\nlayout sizes " + sizes +
                            "\nlayout significant_bits 16\nrepresentation format " + format + "\nrepresentation sign " +
                            sign + "\nrepresentation compression " + compression + "\nrepresentation byte_order " +
                            bytes + "\nparameter scale " + scale + "\nparameter units " + units +
                            "\nparameter origin " + origin + "\n" + more;
        if (version == "2.0") lines += "end\n";
        for (char& c : lines) c = c == ' ' ? separators[0] : c == '\n' ? separators[1] : c;
        return separators + lines;
    }
};

/// The bytes of `count` values of type T that count up from 0.
template <typename T>
std::string counted(int count = kVoxels, bool big = false) {
    std::string bytes;
    for (int n = 0; n < count; ++n) {
        const T value = T(n);
        std::string one(reinterpret_cast<const char*>(&value), sizeof(T));
        if (big) std::reverse(one.begin(), one.end());
        bytes += one;
    }
    return bytes;
}

void check_counts(const Image& image, int first = 0) {
    REQUIRE(image.geometry().size == kSize);
    int wrong = 0;
    for (int k = 0; k < kSize[2]; ++k)
        for (int j = 0; j < kSize[1]; ++j)
            for (int i = 0; i < kSize[0]; ++i) wrong += image.at(i, j, k) == first + i + 4 * j + 12 * k ? 0 : 1;
    CHECK(wrong == 0);
}

std::string gzipped(const std::string& text) { return test::deflated(text, 16 + MAX_WBITS); }

}  // namespace

TEST_CASE("ICS: voxels of every type are read, in either byte order") {
    const Scratch scratch;
    const auto read = [&](const std::string& sizes, const std::string& format, const std::string& sign,
                          const std::string& bytes, const std::string& voxels) {
        Header header;
        header.sizes = sizes;
        header.format = format;
        header.sign = sign;
        header.bytes = bytes;
        Image image = read_image(scratch.write("a.ics", header.text() + voxels));
        check_counts(image);
        return image.pixel_type();
    };
    CHECK(read("8 4 3 2", "integer", "unsigned", "1", counted<std::uint8_t>()) == PixelType::UInt8);
    CHECK(read("8 4 3 2", "integer", "signed", "1", counted<std::int8_t>()) == PixelType::Int8);
    CHECK(read("16 4 3 2", "integer", "unsigned", "1 2", counted<std::uint16_t>()) == PixelType::UInt16);
    CHECK(read("16 4 3 2", "integer", "signed", "2 1", counted<std::int16_t>(kVoxels, true)) == PixelType::Int16);
    CHECK(read("32 4 3 2", "integer", "unsigned", "4 3 2 1", counted<std::uint32_t>(kVoxels, true)) ==
          PixelType::UInt32);
    CHECK(read("32 4 3 2", "integer", "signed", "1 2 3 4", counted<std::int32_t>()) == PixelType::Int32);
    CHECK(read("32 4 3 2", "real", "signed", "1 2 3 4", counted<float>()) == PixelType::Float);
    CHECK(read("32 4 3 2", "float", "signed", "1 2 3 4", counted<float>()) == PixelType::Float);
    CHECK(read("64 4 3 2", "real", "signed", "8 7 6 5 4 3 2 1", counted<double>(kVoxels, true)) == PixelType::Double);
}

TEST_CASE("ICS: spacing and origin are converted to the unit of x") {
    const Scratch scratch;
    Header header;
    const std::string voxels = counted<std::uint16_t>();
    ImageInfo info = read_image_info(scratch.write("a.ics", header.text() + voxels));
    CHECK(info.format == "ICS 2.0");
    CHECK(info.geometry.unit == "um");
    const Vec3 spacing{0.5, 0.25, 2}, origin{10, -20, 3};
    for (int a = 0; a < 3; ++a) {
        CHECK(info.geometry.spacing[a] == Approx(spacing[a]));
        CHECK(info.geometry.origin[a] == Approx(origin[a]));
    }
    header.units = "relative undefined undefined undefined";
    header.scale = "1 1 1 1";
    info = read_image_info(scratch.write("a.ics", header.text() + voxels));
    CHECK(info.spacing_known == std::array<bool, 3>{false, false, false});
    CHECK(info.geometry.unit.empty());
    header.scale = "1 0.5 0.5 2";  // a spacing without a known unit
    info = read_image_info(scratch.write("a.ics", header.text() + voxels));
    CHECK(info.geometry.spacing_known);
    header.units = "relative um um furlongs";  // which cannot be converted to um
    info = read_image_info(scratch.write("a.ics", header.text() + voxels));
    CHECK(info.spacing_known == std::array<bool, 3>{true, true, false});
    header.scale = "1 1 1 1";
    header.units = "bits px pixel Pixel";
    info = read_image_info(scratch.write("a.ics", header.text() + voxels));
    CHECK(info.spacing_known == std::array<bool, 3>{false, false, false});
    CHECK(info.geometry.unit.empty());
}

TEST_CASE("ICS: the voxels of version 1 are in the .ids file beside the header") {
    const Scratch scratch;
    Header header;
    header.version = "1.0";
    const std::string path = scratch.write("a.ics", header.text());
    CHECK_THAT(message_of([&] { (void)read_image(path); }), Catch::Contains("a.ids"));
    scratch.write("a.ids", counted<std::uint16_t>());
    check_counts(read_image(path));
    CHECK(list_image_files(path) == std::vector<std::string>{scratch.path("a.ids")});
    CHECK(read_image_info(path).format == "ICS 1.0");
    scratch.write("a.ids", counted<std::uint16_t>().substr(1));
    CHECK_THAT(message_of([&] { (void)read_image(path); }), Catch::Contains("cannot hold"));
    CHECK_THAT(message_of([&] { (void)read_image(scratch.path("a.ids")); }), Catch::Contains("open its header"));
}

TEST_CASE("ICS: the voxels of version 1 may be in .ids.gz, if there is no .ids") {
    const Scratch scratch;
    Header header;
    header.version = "1.0";
    const std::string path = scratch.write("a.ics", header.text());
    scratch.write("a.ids.gz", gzipped(counted<std::uint16_t>()));
    check_counts(read_image(path));
    CHECK(list_image_files(path) == std::vector<std::string>{scratch.path("a.ids.gz")});
    scratch.write("a.ids", counted<std::uint16_t>());
    check_counts(read_image(path));
    CHECK(list_image_files(path) == std::vector<std::string>{scratch.path("a.ids")});
}

TEST_CASE("ICS: header variants of other programs are read") {
    const Scratch scratch;
    const auto read = [&](const Header& header, int volumes = 1) {
        const std::string path = scratch.write("a.ics", header.text() + counted<std::uint16_t>(volumes * kVoxels));
        ReadImageOptions first;
        first.channel = first.frame = 0;
        check_counts(read_image(path, first));
        return read_image_info(path);
    };
    Header huygens;
    huygens.order = "bits x y z p";
    huygens.sizes = "16 4 3 2 1";
    huygens.more = "layout coordinates cartesian\n";
    const ImageInfo info = read(huygens);
    CHECK(std::find(info.fields.begin(), info.fields.end(),
                    std::pair<std::string, std::string>{"layout coordinates", "cartesian"}) != info.fields.end());
    for (const char* channels : {"p", "c", "ch", "channel", "Channels", "probe", "probes"}) {
        Header header;
        header.order = std::string("bits x y z time lifetime ") + channels;
        header.sizes = "16 4 3 2 3 1 2";
        const ImageInfo several = read(header, 6);
        CHECK(several.channels == 2);
        CHECK(several.frames == 3);
        CHECK(several.axis_order == "XYZTC");
    }
    // As in files of Bio-Formats, the sizes are followed by blanks, although the separator is a tab.
    std::string padded = Header().text();
    padded.insert(padded.find("16\t4\t3\t2") + 8, "\t     ");
    check_counts(read_image(scratch.write("padded.ics", padded + counted<std::uint16_t>())));
    Header more_names;
    more_names.order = "bits x y z ch t";
    more_names.parameters = "4";
    CHECK(read(more_names).channels == 1);
    Header twice;
    twice.more = "layout sizes 16 4 3 2\n";
    twice.sizes = "16 9 9 9";
    (void)read(twice);
}

TEST_CASE("ICS: gzip, other separators and long histories are read") {
    const Scratch scratch;
    Header header;
    const std::string voxels = counted<std::uint16_t>();
    check_counts(read_image(scratch.write("tab.ics", header.text("\t\r") + voxels)));
    check_counts(read_image(scratch.write("bar.ics", header.text("|\n") + voxels)));
    for (int n = 0; n < 2000; ++n) header.more += "history software step " + std::to_string(n) + "\n";
    check_counts(read_image(scratch.write("long.ics", header.text() + voxels)));
    header.more.clear();
    header.compression = "gzip";
    check_counts(read_image(scratch.write("packed.ics", header.text() + gzipped(voxels))));
}

TEST_CASE("ICS: channels and time points are volumes, in either order") {
    const Scratch scratch;
    for (const bool channels_first : {true, false}) {
        Header header;
        header.order = channels_first ? "bits x y z ch t" : "bits x y z t ch";
        header.sizes = channels_first ? "16 4 3 2 2 3" : "16 4 3 2 3 2";
        const std::string path = scratch.write("a.ics", header.text() + counted<std::uint16_t>(6 * kVoxels));
        const ImageInfo info = read_image_info(path);
        CHECK(info.channels == 2);
        CHECK(info.frames == 3);
        CHECK(info.axis_order == (channels_first ? "XYZCT" : "XYZTC"));
        ReadImageOptions options;
        options.channel = 1;
        options.frame = 2;
        check_counts(read_image(path, options), 5 * kVoxels);
        options.frame = 0;
        check_counts(read_image(path, options), (channels_first ? 1 : 3) * kVoxels);
    }
}

TEST_CASE("ICS: invalid, inconsistent and unsupported files are rejected with the reason") {
    const Scratch scratch;
    const Header good{};
    const std::string voxels = counted<std::uint16_t>();
    const auto is_refused = [&](const std::string& bytes, const std::string& part) {
        CHECK_THAT(message_of([&] { (void)read_image(scratch.write("a.ics", bytes)); }), Catch::Contains(part));
    };
    is_refused("\t\t\t\t", "expected two separators");
    is_refused("\t\nno image", "expected ics_version 1.0 or 2.0");
    is_refused(good.text().substr(0, good.text().size() - 4), "its header has no end");
    is_refused(good.text() + voxels.substr(1), "cannot hold");
    const auto with = [&](std::string Header::*field, const std::string& value) {
        Header header;
        header.*field = value;
        return header.text() + voxels;
    };
    is_refused(with(&Header::version, "3.0"), "expected ics_version 1.0 or 2.0");
    is_refused(with(&Header::order, "bits y x z"), "expected the axes bits, x, y, z");
    is_refused(with(&Header::order, "x y z bits"), "expected the axes bits, x, y, z");
    is_refused(with(&Header::order, "bits x y z ch"), "got 5 names and 4 sizes");
    is_refused(with(&Header::parameters, "5"), "got 4 names and 4 sizes, and '5' as the number of axes");
    is_refused(with(&Header::parameters, "many"), "got 4 names and 4 sizes, and 'many' as the number of axes");
    is_refused(with(&Header::order, "bits x y"), "expected a 3D image");
    is_refused(with(&Header::sizes, "16 4 3 0"), "expected a 3D image");
    is_refused(with(&Header::sizes, "16 4 3 -2"), "expected whole numbers as sizes");
    is_refused(with(&Header::sizes, "16 4 3 2000000000"), "the header claims");
    is_refused(with(&Header::sizes, "16 500000000 500000000 500000000"), "the header claims");
    is_refused(with(&Header::sizes, "12 4 3 2"), "with 12 bits");
    is_refused(with(&Header::format, "complex"), "got the format 'complex'");
    is_refused(with(&Header::bytes, "2 2"), "expected the byte order");
    is_refused(with(&Header::compression, "compress"), "got the compression 'compress'");
    is_refused(with(&Header::scale, "1 nan 1 1"), "expected a number in parameter scale");
    is_refused(with(&Header::more, "source file /etc/passwd\n"), "names another one");
    Header many;
    many.order = "bits x y z ch t";
    many.sizes = "16 4 3 2 1000000 1000000";
    is_refused(many.text() + voxels, "2^20");
    Header unknown;
    unknown.order = "bits x y z lifetime";
    unknown.sizes = "16 4 3 2 2";
    is_refused(unknown.text() + voxels, "channels (p, c, ch, channel, channels, probe or probes)");
    Header history;
    history.more = "history step " + std::string(std::size_t(1) << 20, 'a') + "\n";
    is_refused(history.text() + voxels, "expected a header of at most 1 MiB");
}

TEST_CASE("ICS: damaged files never crash the reader, and truncated ones are rejected") {
    const Scratch scratch;
    const std::string path = scratch.write("f.ics", Header().text() + counted<std::uint16_t>());
    const FuzzCounts counts = fuzz(
        scratch, path, [](const std::string& bad) { (void)read_image(bad).range(); }, 80, 400);
    CHECK(counts.truncated_accepted == 0);
}
