#include "covol/program_marks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "base/file.h"
#include "base/text.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "io/write/shortest.h"

namespace covol {
namespace {

using detail::shortest;

/// The text as a quoted field of a CSV table, in which quotes are doubled.
std::string quoted_field(const std::string& text) {
    std::string field = "\"";
    for (const char c : text) field += c == '"' ? std::string("\"\"") : std::string(1, c);
    return field + '"';
}

std::string to_napari(const std::vector<NamedMark>& marks) {
    std::string text = "index,axis-0,axis-1,axis-2,name\n";
    for (std::size_t n = 0; n < marks.size(); ++n) {
        const auto [x, y, z] = marks[n].index;
        text += std::to_string(n) + "," + shortest(z) + "," + shortest(y) + "," + shortest(x) + "," +
                quoted_field(marks[n].name) + "\n";
    }
    return text;
}

std::string to_slicer(const std::vector<NamedMark>& marks, const ImageGeometry& geometry) {
    nlohmann::ordered_json points = nlohmann::ordered_json::array();
    for (std::size_t n = 0; n < marks.size(); ++n)
        points.push_back({{"id", std::to_string(n + 1)},
                          {"label", marks[n].name},
                          {"position", geometry.index_to_world(marks[n].index)},
                          {"positionStatus", "defined"}});
    nlohmann::ordered_json file;
    file["@schema"] =
        "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
        "markups-schema-v1.0.3.json#";
    file["markups"].push_back({{"type", "Fiducial"}, {"coordinateSystem", "LPS"}, {"controlPoints", points}});
    return file.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

/// Writes a number at the position `at`, big-endian as Java, in which ImageJ is written, stores numbers.
template <typename T>
void put(std::string& bytes, std::size_t at, T value) {
    using Bits = std::conditional_t<sizeof(T) == 1, std::uint8_t,
                                    std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint32_t>>;
    const auto bits = std::bit_cast<Bits>(value);
    for (std::size_t n = 0; n < sizeof(T); ++n) bytes[at + n] = char(bits >> (8 * (sizeof(T) - 1 - n)) & 255);
}

/// A multi-point ROI with the layout of ij/io/RoiEncoder.java of ImageJ 1.53. Coordinates are in pixels; for points,
/// pixel centres have integer coordinates.
std::string to_fiji(const std::string& path, const std::vector<NamedMark>& marks) {
    constexpr std::size_t kMax = 65535;  // the number of points is stored in 16 bits
    if (marks.size() > kMax)
        throw Error(Errc::Unsupported, path + ": a multi-point of Fiji has at most 65535 points, got " +
                                           std::to_string(marks.size()) + "; write .csv or .mrk.json");
    const std::size_t n = marks.size();
    Vec3 low{0, 0, 0}, high{0, 0, 0};
    for (std::size_t m = 0; m < n; ++m)
        for (int a = 0; a < 3; ++a) {
            low[a] = m == 0 ? marks[m].index[a] : std::min(low[a], marks[m].index[a]);
            high[a] = m == 0 ? marks[m].index[a] : std::max(high[a], marks[m].index[a]);
        }
    // [pixels] The edges of the bounding box, which are one larger than the maximum coordinate, are stored in 16 bits
    // with a sign.
    constexpr double kFarthest = 32766;
    if (high[0] > kFarthest || high[1] > kFarthest)
        throw Error(Errc::Unsupported, path + ": coordinates of a Fiji selection are at most 32766 pixels, got (" +
                                           shortest(high[0]) + ", " + shortest(high[1]) + "); write .csv or .mrk.json");
    if (low[0] < -0.5 || low[1] < -0.5 || low[2] < -0.5)
        throw Error(Errc::InvalidInput, path + ": expected marks within the image, got voxel (" + shortest(low[0]) +
                                            ", " + shortest(low[1]) + ", " + shortest(low[2]) + ")");
    const std::size_t reals = 64 + 4 * n, second = reals + 8 * n, counters = second + 64;
    std::string bytes(counters + 4 * n, '\0');
    bytes.replace(0, 4, "Iout");
    put<std::int16_t>(bytes, 4, 227);
    put<std::uint8_t>(bytes, 6, 10);  // type of the ROI: points
    const auto left = std::int16_t(std::floor(low[0])), top = std::int16_t(std::floor(low[1]));
    put<std::int16_t>(bytes, 8, top);
    put<std::int16_t>(bytes, 10, left);
    put<std::int16_t>(bytes, 12, std::int16_t(std::ceil(high[1]) + 1));
    put<std::int16_t>(bytes, 14, std::int16_t(std::ceil(high[0]) + 1));
    put<std::uint16_t>(bytes, 16, std::uint16_t(n));
    put<std::int16_t>(bytes, 50, 128);  // option bit: the file also stores coordinates with fractions of pixels
    put<std::uint32_t>(bytes, 60, std::uint32_t(second));
    put<std::uint32_t>(bytes, second + 48, std::uint32_t(counters));
    for (std::size_t m = 0; m < n; ++m) {
        const auto [x, y, z] = marks[m].index;
        put<std::int16_t>(bytes, 64 + 2 * m, std::int16_t(std::lround(x) - left));
        put<std::int16_t>(bytes, 64 + 2 * n + 2 * m, std::int16_t(std::lround(y) - top));
        put<float>(bytes, reals + 4 * m, float(x));
        put<float>(bytes, reals + 4 * n + 4 * m, float(y));
        // Bits 0 to 7: the counter, 0; from bit 8 on: the slice, counted from 1.
        put<std::int32_t>(bytes, counters + 4 * m, std::int32_t(std::lround(z) + 1) << 8);
    }
    return bytes;
}

}  // namespace

void check_program_marks(const std::string& path) {
    const std::string name = detail::lower(path);
    if (!name.ends_with(".csv") && !name.ends_with(".mrk.json") && !name.ends_with(".roi"))
        throw Error(Errc::InvalidOptions, path + ": expected a name that ends in " + kProgramMarks);
}

void write_program_marks(const std::string& path, const std::vector<NamedMark>& marks, const ImageGeometry& geometry) {
    check_program_marks(path);
    const std::string end = detail::extension(path);
    write_text_file(path, end == ".csv"   ? to_napari(marks)
                          : end == ".roi" ? to_fiji(path, marks)
                                          : to_slicer(marks, geometry));
}

}  // namespace covol
