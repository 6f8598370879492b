#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "covol/error.h"
#include "io/points/bytes.h"
#include "io/points/point_formats.h"
#include "io/points/point_text.h"

// Laser scans: PCD (pointclouds.org, "The PCD file format", version 0.7), LAS (ASPRS, versions 1.0 to 1.4) and PTX
// (Leica Geosystems).
namespace covol::detail {
namespace {

using std::string_view;

// ---------------------------------------------------------------------------------------------- PCD

struct PcdField {
    std::string name;
    std::uint64_t size = 4;
    char type = 'F';
    std::uint64_t count = 1;
};

struct PcdHeader {
    std::vector<PcdField> fields;
    std::uint64_t points = 0;
    std::optional<Vec3> viewpoint;
    /// Whether the points are the pixels of a depth camera, row by row; the camera is at 0 unless a viewpoint is
    /// stated.
    bool is_organised = false;
    std::string data;

    [[nodiscard]] std::uint64_t stride() const {
        std::uint64_t bytes = 0;
        for (const PcdField& field : fields) bytes += field.size * field.count;
        return bytes;
    }
};

std::uint64_t to_count(const std::string& path, std::size_t line, string_view text, std::uint64_t maximum) {
    const double value = to_coordinate(path, line, text);
    if (!(value >= 0) || value != std::floor(value) || value > double(maximum))
        fail(path, line, "expected a whole number up to " + std::to_string(maximum) + ", got " + quote(text));
    return static_cast<std::uint64_t>(value);
}

PcdHeader read_pcd_header(const std::string& path, Lines& lines) {
    constexpr std::uint64_t kMaxFields = 1000, kMaxPoints = std::uint64_t(1) << 40;
    PcdHeader header;
    std::optional<std::uint64_t> points;
    std::uint64_t width = 0, height = 1;
    string_view line;
    std::vector<string_view> words;
    while (lines.next_words(line, words)) {
        const string_view key = words[0];
        const bool per_field = key == "SIZE" || key == "TYPE" || key == "COUNT";
        if (words.size() < 2)
            fail(path, lines.number(), "expected a keyword of a PCD header and its values, got " + quote(line));
        if (per_field && words.size() != header.fields.size() + 1)
            fail(path, lines.number(),
                 std::string(key) + ": expected one value for each field of the line FIELDS (" +
                     std::to_string(header.fields.size()) + "), got " + std::to_string(words.size() - 1));
        if (key == "FIELDS" || key == "COLUMNS") {
            if (words.size() > kMaxFields)
                fail(path, lines.number(),
                     "expected at most " + std::to_string(kMaxFields - 1) + " fields, got " +
                         std::to_string(words.size() - 1));
            header.fields.assign(words.size() - 1, {});
            for (std::size_t n = 1; n < words.size(); ++n) header.fields[n - 1].name = lower(words[n]);
        } else if (per_field) {
            for (std::size_t n = 1; n < words.size(); ++n) {
                PcdField& field = header.fields[n - 1];
                if (key == "SIZE") field.size = to_count(path, lines.number(), words[n], 8);
                if (key == "TYPE") field.type = words[n][0];
                if (key == "COUNT") field.count = to_count(path, lines.number(), words[n], 1000000);
            }
        } else if (key == "WIDTH") {
            width = to_count(path, lines.number(), words[1], 1U << 31);
        } else if (key == "HEIGHT") {
            height = to_count(path, lines.number(), words[1], 1U << 31);
        } else if (key == "POINTS") {
            points = to_count(path, lines.number(), words[1], kMaxPoints);
        } else if (key == "DATA") {
            header.data = lower(words[1]);
            header.points = points.value_or(width * height);
            header.is_organised = height > 1;
            if (header.points > kMaxPoints)
                fail(path, "expected at most " + std::to_string(kMaxPoints) + " points, got " +
                               std::to_string(header.points));
            return header;
        } else if (key == "VIEWPOINT" && words.size() >= 4) {
            Vec3 at;
            for (std::size_t a = 0; a < 3; ++a) at[a] = to_coordinate(path, lines.number(), words[a + 1]);
            header.viewpoint = at;
        } else if (key != "VERSION" && key != "VIEWPOINT") {
            fail(path, lines.number(), "expected a keyword of a PCD header, such as FIELDS or DATA, got " + quote(key));
        }
    }
    fail(path, "expected the line DATA, got the end; the file is truncated");
}

/// The indices of the fields x, y, z, and of the three fields of the normal if all of them exist. @throws Error
/// InvalidInput if x, y or z is missing.
std::vector<std::size_t> pcd_columns(const std::string& path, const PcdHeader& header) {
    std::vector<std::size_t> at;
    for (const char* name : {"x", "y", "z", "normal_x", "normal_y", "normal_z"}) {
        std::size_t found = header.fields.size();
        for (std::size_t n = 0; n < header.fields.size(); ++n)
            if (header.fields[n].name == name && header.fields[n].count == 1) found = n;
        if (found < header.fields.size())
            at.push_back(found);
        else if (at.size() < 3)
            fail(path, std::string("expected a field '") + name + "', got none");
        else
            break;
    }
    if (at.size() < 6) at.resize(3);
    return at;
}

double pcd_value(const std::string& path, const char* data, const PcdField& field) {
    constexpr bool kSwap = std::endian::native == std::endian::big;
    if (field.type == 'F' && field.size == 4) return load<float>(data, kSwap);
    if (field.type == 'F' && field.size == 8) return load<double>(data, kSwap);
    if (field.type == 'I' && field.size == 4) return load<std::int32_t>(data, kSwap);
    if (field.type == 'I' && field.size == 2) return load<std::int16_t>(data, kSwap);
    if (field.type == 'U' && field.size == 4) return load<std::uint32_t>(data, kSwap);
    if (field.type == 'U' && field.size == 2) return load<std::uint16_t>(data, kSwap);
    throw Error(Errc::Unsupported, path + ": field " + quote(field.name) +
                                       ": expected 4 or 8 bytes of type F, or 2 or 4 bytes of type I or U, got " +
                                       std::to_string(field.size) + " of type " + field.type);
}

/// Unpacks Marc Lehmann's LZF: runs of literal bytes, and references to earlier output. Returns false if the data are
/// damaged.
bool lzf_decompress(string_view in, std::string& out) {
    std::size_t at = 0, done = 0;
    while (at < in.size()) {
        std::size_t control = static_cast<unsigned char>(in[at++]);
        if (control < 32) {
            const std::size_t count = control + 1;
            if (count > in.size() - at || count > out.size() - done) return false;
            std::copy_n(in.data() + at, count, out.data() + done);
            at += count;
            done += count;
            continue;
        }
        std::size_t count = control >> 5, back = (control & 31) << 8;
        if (count == 7) {
            if (at == in.size()) return false;
            count += static_cast<unsigned char>(in[at++]);
        }
        if (at == in.size()) return false;
        back += static_cast<unsigned char>(in[at++]) + std::size_t(1);
        count += 2;
        if (back > done || count > out.size() - done) return false;
        // Bytes are copied one by one, because the range that is read may overlap the range that is written.
        for (; count > 0; --count, ++done) out[done] = out[done - back];
    }
    return done == out.size();
}

/// Adds a point unless a coordinate is NaN or infinite: organised clouds have NaN at pixels without a measurement.
void add_valid(PointTable& table, const std::vector<double>& values, std::size_t& invalid) {
    if (!std::isfinite(values[0]) || !std::isfinite(values[1]) || !std::isfinite(values[2])) {
        ++invalid;
        return;
    }
    table.points.push_back({values[0], values[1], values[2]});
    if (values.size() == 6) table.normals.push_back(normal_of({values[3], values[4], values[5]}));
}

void read_pcd_ascii(const std::string& path, const PcdHeader& header, Lines& lines, PointTable& table,
                    std::size_t& invalid) {
    const std::vector<std::size_t> at = pcd_columns(path, header);
    std::vector<std::size_t> column(at.size(), 0);
    std::vector<double> values(at.size());
    for (std::size_t a = 0; a < at.size(); ++a)
        for (std::size_t n = 0; n < at[a]; ++n) column[a] += header.fields[n].count;
    string_view line;
    std::vector<string_view> words;
    for (std::uint64_t n = 0; n < header.points;) {
        if (!lines.next(line))
            fail(path, "expected " + std::to_string(header.points) + " points, got " + std::to_string(n) +
                           "; the file is truncated");
        if (line.empty()) continue;
        ++n;
        split(line, ' ', words);
        for (std::size_t a = 0; a < at.size(); ++a) {
            const auto value = column[a] < words.size() ? to_number(words[column[a]]) : std::nullopt;
            if (!value)
                fail(path, lines.number(),
                     std::string("expected numbers for x, y and z") + (at.size() > 3 ? " and the normal" : "") +
                         ", got " + quote(line));
            values[a] = *value;
        }
        add_valid(table, values, invalid);
    }
}

/// @param planar  whether the values of a field are stored together for all points; otherwise the fields of a point are
/// stored together
void read_pcd_binary(const std::string& path, const PcdHeader& header, string_view data, bool planar, PointTable& table,
                     std::size_t& invalid) {
    const std::vector<std::size_t> at = pcd_columns(path, header);
    const std::uint64_t stride = header.stride();
    if (header.points > data.size() / std::max<std::uint64_t>(stride, 1))
        fail(path, "expected " + std::to_string(header.points) + " points of " + std::to_string(stride) +
                       " bytes, got " + std::to_string(data.size()) + " bytes; the file is truncated");
    std::vector<std::uint64_t> offset(at.size(), 0);
    std::vector<double> values(at.size());
    for (std::size_t a = 0; a < at.size(); ++a)
        for (std::size_t n = 0; n < at[a]; ++n) offset[a] += header.fields[n].size * header.fields[n].count;
    table.points.reserve(header.points);
    for (std::uint64_t n = 0; n < header.points; ++n) {
        for (std::size_t a = 0; a < at.size(); ++a) {
            const PcdField& field = header.fields[at[a]];
            const std::uint64_t place = planar ? header.points * offset[a] + n * field.size : n * stride + offset[a];
            values[a] = pcd_value(path, data.data() + place, field);
        }
        add_valid(table, values, invalid);
    }
}

std::string unpack_pcd(const std::string& path, const PcdHeader& header, string_view data) {
    const Bytes bytes(data, path, std::endian::little);
    const std::uint64_t packed = bytes.at<std::uint32_t>(0), size = bytes.at<std::uint32_t>(4);
    // Maximum ratio of unpacked to packed bytes in LZF, in which three bytes encode at most 264 bytes.
    constexpr std::uint64_t kLargestRatio = 264;
    const std::uint64_t stride = header.stride();
    if (size > kLargestRatio * packed || stride == 0 || size / stride < header.points)
        fail(path, std::to_string(packed) + " packed bytes cannot hold " + std::to_string(header.points) +
                       " points; the file is damaged");
    std::string content(size, '\0');
    if (!lzf_decompress(bytes.part(8, packed), content)) fail(path, "its packed points are damaged");
    return content;
}

// ---------------------------------------------------------------------------------------------- PTX

/// The header of a scan: numbers of columns and rows, the scanner's position and axes, and a 4 x 4 matrix. The position
/// of a point is its row vector (x, y, z, 1) times the matrix.
struct PtxHeader {
    std::uint64_t columns = 0, rows = 0;
    Vec3 scanner{};
    std::array<std::array<double, 4>, 4> matrix{};

    [[nodiscard]] Vec3 place(const Vec3& p) const {
        Vec3 world{};
        for (std::size_t w = 0; w < 3; ++w)
            world[w] = p[0] * matrix[0][w] + p[1] * matrix[1][w] + p[2] * matrix[2][w] + matrix[3][w];
        return world;
    }
};

/// How many numbers each of the ten lines of the header of a PTX scan has.
constexpr std::array<std::size_t, 10> kPtxNumbers{1, 1, 3, 3, 3, 3, 4, 4, 4, 4};

PtxHeader read_ptx_header(const std::string& path, Lines& lines) {
    constexpr std::uint64_t kMax = 1U << 20U;
    PtxHeader header;
    string_view line;
    std::vector<string_view> words;
    for (std::size_t n = 0; n < kPtxNumbers.size(); ++n) {
        if (!lines.next_words(line, words)) fail(path, lines.number(), "the header of a PTX scan ends early");
        if (words.size() != kPtxNumbers[n])
            fail(path, lines.number(),
                 "expected " + std::to_string(kPtxNumbers[n]) + " numbers in line " + std::to_string(n + 1) +
                     " of a PTX scan's header, got " + quote(line));
        if (n < 2) (n == 0 ? header.columns : header.rows) = to_count(path, lines.number(), words[0], kMax);
        for (std::size_t w = 0; w < words.size(); ++w) {
            const double value = to_coordinate(path, lines.number(), words[w]);
            if (n == 2) header.scanner[w] = value;
            if (n >= 6) header.matrix[n - 6][w] = value;
        }
    }
    return header;
}

}  // namespace

PointTable parse_pcd(const std::string& path, const std::string& bytes) {
    Lines lines(bytes);
    const PcdHeader header = read_pcd_header(path, lines);
    PointTable table;
    std::size_t invalid = 0;
    if (header.data == "ascii")
        read_pcd_ascii(path, header, lines, table, invalid);
    else if (header.data == "binary")
        read_pcd_binary(path, header, lines.rest(), false, table, invalid);
    else if (header.data == "binary_compressed")
        read_pcd_binary(path, header, unpack_pcd(path, header, lines.rest()), true, table, invalid);
    else
        throw Error(Errc::Unsupported,
                    path + ": expected DATA ascii, binary or binary_compressed, got " + quote(header.data));
    if (header.viewpoint && (header.is_organised || *header.viewpoint != Vec3{0, 0, 0}))
        table.sensor = header.viewpoint;
    table.rule = "points of a PCD (" + header.data + ")";
    if (invalid > 0) table.rule += ", " + std::to_string(invalid) + " invalid ones left out";
    return table;
}

PointTable parse_las(const std::string& path, const std::string& content) {
    const Bytes bytes(content, path, std::endian::little);
    if (bytes.part(0, 4) != "LASF") fail(path, "expected a LAS file, which begins with LASF");
    const int minor = bytes.at<std::uint8_t>(25);
    const int format = bytes.at<std::uint8_t>(104);
    if ((format & 0xC0) != 0)
        throw Error(Errc::Unsupported,
                    path + ": expected LAS, got its compressed form LAZ; unpack it with laszip or pdal translate");
    if (bytes.at<std::uint8_t>(24) != 1 || minor > 4)
        throw Error(Errc::Unsupported, path + ": expected LAS 1.0 to 1.4, got " +
                                           std::to_string(bytes.at<std::uint8_t>(24)) + "." + std::to_string(minor));
    const std::uint64_t begin = bytes.at<std::uint32_t>(96), stride = bytes.at<std::uint16_t>(105);
    std::uint64_t count = bytes.at<std::uint32_t>(107);
    if (minor == 4) count = bytes.at<std::uint64_t>(247);
    if (stride < 12 || begin > bytes.size() || count > (bytes.size() - begin) / stride)
        fail(path, "expected " + std::to_string(count) + " points of " + std::to_string(stride) + " bytes from byte " +
                       std::to_string(begin) + ", but the file has " + std::to_string(bytes.size()) +
                       "; it is truncated");
    Vec3 scale, offset;
    for (std::uint64_t a = 0; a < 3; ++a) {
        scale[a] = bytes.at<double>(131 + 8 * a);
        offset[a] = bytes.at<double>(155 + 8 * a);
        if (!std::isfinite(scale[a]) || !std::isfinite(offset[a]) || std::abs(scale[a]) > 1e200 ||
            std::abs(offset[a]) > 1e200)
            fail(path, "expected a finite scale and offset");
    }
    PointTable table;
    table.points.resize(count);
    for (std::uint64_t n = 0; n < count; ++n)
        for (std::uint64_t a = 0; a < 3; ++a)
            table.points[n][a] = offset[a] + scale[a] * bytes.at<std::int32_t>(begin + n * stride + 4 * a);
    table.rule = "points of a LAS 1." + std::to_string(minor) + " (format " + std::to_string(format) + ")";
    return table;
}

bool is_ptx(const std::string& text) {
    Lines lines(text);
    string_view line;
    std::vector<string_view> words;
    for (const std::size_t count : kPtxNumbers) {
        if (!lines.next_words(line, words) || words.size() != count) return false;
        for (const string_view word : words)
            if (!to_number(word)) return false;
    }
    // The last line of the header is the last row of the matrix. For a rigid motion, its last number is 1.
    return to_number(words[3]) == 1.0;
}

PointTable parse_ptx(const std::string& path, const std::string& text) {
    PointTable table;
    Lines lines(text);
    std::size_t scans = 0;
    std::uint64_t empty = 0;
    string_view line;
    std::vector<string_view> words;
    while (!trim(lines.rest()).empty() && trim(lines.rest()).find_first_not_of("\r\n\t ") != string_view::npos) {
        const PtxHeader header = read_ptx_header(path, lines);
        ++scans;
        for (std::uint64_t n = 0; n < header.columns * header.rows; ++n) {
            if (!lines.next_words(line, words))
                fail(path, lines.number(),
                     "expected " + std::to_string(header.columns * header.rows) + " points of scan " +
                         std::to_string(scans) + ", got " + std::to_string(n) + "; the file is truncated");
            if (words.size() < 3) fail(path, lines.number(), "expected 3 numbers, got " + quote(line));
            Vec3 point{};
            for (std::size_t a = 0; a < 3; ++a) point[a] = to_coordinate(path, lines.number(), words[a]);
            // A direction from which no reflection returned is stored as the point 0 0 0.
            if (point == Vec3{0, 0, 0})
                ++empty;
            else
                table.points.push_back(header.place(point));
        }
        table.sensor = header.scanner;
    }
    if (scans > 1) table.sensor.reset();
    table.space = PointSpace::World;
    table.order = PointOrder::XYZ;
    table.rule = "points of " + std::to_string(scans) + (scans == 1 ? " PTX scan" : " PTX scans") +
                 ", by the matrix of its header, " + std::to_string(empty) + " without an echo skipped";
    return table;
}

}  // namespace covol::detail
