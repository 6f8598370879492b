#include <cmath>
#include <map>
#include <optional>

#include "covol/error.h"
#include "io/points/bytes.h"
#include "io/points/point_formats.h"
#include "io/points/point_text.h"
#include "io/points/programs/zip.h"

// The format is defined by ij/io/RoiDecoder.java and ij/gui/PointRoi.java of ImageJ 1.54.
//
// In coordinates of area outlines, integers are corners of pixels; in those of lines and points, integers are centres
// (Roi.useLineSubpixelConvention()). Half a pixel is therefore subtracted from the coordinates of areas. Slices count
// from 1.
namespace covol::detail {
namespace {

enum Type { kPolygon, kRectangle, kOval, kLine, kFreeLine, kPolyline, kNothing, kFreehand, kTraced, kAngle, kPoint };
enum Subtype { kText = 1, kImage = 4 };
constexpr int kSubPixel = 128;  // bit of the options: the file has coordinates with fractions of pixels
constexpr std::uint64_t kHeader = 64;

const char* name_of(int type) {
    static constexpr const char* kNames[] = {"polygon", "rectangle", "oval",   "line",  "freeline", "polyline",
                                             "nothing", "freehand",  "traced", "angle", "point"};
    return kNames[type];
}

/// One region of interest.
class Roi {
public:
    Roi(const std::string& path, const std::string& name, std::string_view data)
        : path_(path), bytes_(data, path, std::endian::big), name_(name) {
        if (data.substr(0, 4) != "Iout")
            fail(path, "ROI " + quote(name) + ": expected a Fiji ROI, got " + quote(data.substr(0, 4)));
        version_ = bytes_.at<std::int16_t>(4);
        type_ = bytes_.at<std::uint8_t>(6);
        if (type_ > kPoint) fail(path, "ROI " + quote(name) + ": unknown type " + std::to_string(type_));
        subtype_ = bytes_.at<std::int16_t>(48);
        sub_pixel_ = version_ >= 222 && (bytes_.at<std::int16_t>(50) & kSubPixel) != 0;
        second_ = bytes_.at<std::uint32_t>(60);
        if (second_ != 0) read_name();
    }

    [[nodiscard]] const char* kind() const { return is_composite() ? "composite" : name_of(type_); }

    /// The group of the ROI in the ROI Manager, from 1; 0: none.
    [[nodiscard]] int group() const {
        return version_ >= 228 && second_ != 0 ? bytes_.at<std::uint8_t>(second_ + 30) : 0;
    }

    /// Adds the points of the ROI to the table; returns false if it has none (a text, a picture).
    /// @param structures_by  "group", "counter" or empty
    bool add_to(PointTable& table, const std::string& structures_by) const {
        if (!add_marks(table, structures_by == "counter")) return false;
        if (structures_by == "group") name_structure(table, path_, "group " + std::to_string(group()));
        return true;
    }

private:
    bool add_marks(PointTable& table, bool by_counter) const {
        if (is_composite()) {
            add_composite(table);
            return true;
        }
        if (subtype_ == kText || subtype_ == kImage || type_ == kNothing) return false;
        switch (type_) {
            case kPoint: add_points(table, by_counter); break;
            case kRectangle: add_rectangle(table); break;
            case kOval: add_oval(table); break;
            case kLine: add_straight(table); break;
            default: add_outline(table);
        }
        return true;
    }

    [[nodiscard]] bool is_composite() const { return bytes_.at<std::int32_t>(36) > 0; }

    void read_name() {
        const auto offset = bytes_.at<std::uint32_t>(second_ + 16), length = bytes_.at<std::uint32_t>(second_ + 20);
        if (offset == 0 || length == 0) return;
        const std::string_view text = bytes_.part(offset, 2 * std::uint64_t(length));
        name_.clear();
        for (std::size_t n = 1; n < text.size(); n += 2)  // UTF-16; characters other than ASCII become "?"
            name_ += text[n - 1] == 0 && static_cast<unsigned char>(text[n]) < 128 ? text[n] : '?';
    }

    /// A 16-bit coordinate, as ImageJ's getShort() reads it: values below -5000 are positive coordinates above 32767
    /// that have overflowed.
    [[nodiscard]] double coordinate(std::uint64_t offset) const {
        const int value = bytes_.at<std::int16_t>(offset);
        return value < -5000 ? value + 65536 : value;
    }
    [[nodiscard]] double real(std::uint64_t offset) const {
        const double value = bytes_.at<float>(offset);
        if (!std::isfinite(value))
            fail(path_, "ROI " + quote(name_) + ": expected finite coordinates, got NaN or infinity");
        return value;
    }

    /// The slice of the ROI, counted from 0; nothing if the ROI is on all slices. The slice is stored as the z of a
    /// hyperstack, as the position in a stack, or in the name that the ROI Manager assigned ("0012-0100-0200": slice,
    /// y, x).
    [[nodiscard]] std::optional<double> slice() const {
        if (second_ != 0) {
            const int channel = bytes_.at<std::int32_t>(second_ + 4), z = bytes_.at<std::int32_t>(second_ + 8),
                      frame = bytes_.at<std::int32_t>(second_ + 12);
            if (z > 0) return z - 1;
            if (channel > 0 || frame > 0) return std::nullopt;
        }
        const int position = bytes_.at<std::int32_t>(56);
        if (position > 0) return position - 1;
        for (const std::size_t digits : {4, 5, 6})
            if (name_.size() >= 3 * digits + 2 && name_[digits] == '-' && name_[2 * digits + 1] == '-')
                if (const auto number = to_number(string_view(name_).substr(0, digits)); number && *number > 0)
                    return std::floor(*number) - 1;
        return std::nullopt;
    }
    [[nodiscard]] double required_slice() const {
        if (const auto z = slice()) return *z;
        fail(path_,
             "ROI " + quote(name_) + " (" + kind() +
                 "): expected a slice, but it has none or belongs to all slices; assign one in Fiji (ROI Manager > "
                 "Properties > Position, or draw it while its slice is shown and click Add)");
    }

    [[nodiscard]] std::uint64_t vertex_count() const {
        const std::uint64_t count = bytes_.at<std::uint16_t>(16);
        return count != 0 || type_ != kPoint ? count : bytes_.at<std::uint32_t>(18);
    }

    /// The x and y of each vertex, as stored in the file.
    [[nodiscard]] std::vector<std::array<double, 2>> vertices() const {
        const std::uint64_t n = vertex_count();
        (void)bytes_.part(kHeader, (sub_pixel_ ? 12 : 4) * n);
        std::vector<std::array<double, 2>> result(n);
        const double left = coordinate(10), top = coordinate(8);
        for (std::uint64_t i = 0; i < n; ++i)
            result[i] = sub_pixel_ ? std::array{real(kHeader + 4 * n + 4 * i), real(kHeader + 8 * n + 4 * i)}
                                   : std::array{left + std::max(0.0, coordinate(kHeader + 2 * i)),
                                                top + std::max(0.0, coordinate(kHeader + 2 * n + 2 * i))};
        return result;
    }

    void add_points(PointTable& table, bool by_counter) const {
        const auto xy = vertices();
        std::uint64_t counters = 0;
        if (version_ >= 227 && second_ != 0) counters = bytes_.at<std::uint32_t>(second_ + 48);
        for (std::uint64_t i = 0; i < xy.size(); ++i) {
            const int both = counters != 0 ? bytes_.at<std::int32_t>(counters + 4 * i) : 0, position = both >> 8;
            table.points.push_back({xy[i][0], xy[i][1], position > 0 ? position - 1 : required_slice()});
            if (by_counter) name_structure(table, path_, "counter " + std::to_string(both & 255));
        }
    }

    void add_outline(PointTable& table) const {
        const bool closed = type_ == kPolygon || type_ == kFreehand || type_ == kTraced;
        const double shift = closed ? -0.5 : 0, z = required_slice();
        std::vector<Vec3> line;
        for (const auto& [x, y] : vertices()) line.push_back({x + shift, y + shift, z});
        if (!line.empty()) add_line(table, line, closed, name_);
    }

    /// x0, y0, width, height of a rectangle or an oval.
    [[nodiscard]] std::array<double, 4> box() const {
        if (sub_pixel_ && version_ >= 223) return {real(18), real(22), real(26), real(30)};
        const double top = coordinate(8), left = coordinate(10);
        return {left, top, coordinate(14) - left, coordinate(12) - top};
    }

    void add_rectangle(PointTable& table) const {
        const auto [x, y, width, height] = box();
        const double x0 = x - 0.5, y0 = y - 0.5, z = required_slice();
        add_line(table, {{x0, y0, z}, {x0 + width, y0, z}, {x0 + width, y0 + height, z}, {x0, y0 + height, z}}, true,
                 name_);
    }

    void add_oval(PointTable& table) const {
        const auto [x, y, width, height] = box();
        add_line(table,
                 ellipse({x - 0.5 + 0.5 * width, y - 0.5 + 0.5 * height, required_slice()}, {0.5 * width, 0, 0},
                         {0, 0.5 * height, 0}),
                 true, name_);
    }

    void add_straight(PointTable& table) const {
        const double z = required_slice();
        add_line(table, {{real(18), real(22), z}, {real(26), real(30), z}}, false, name_);
    }

    /// Adds the outlines of a composite ROI. Its segments are stored as in java.awt.geom.PathIterator: the type, then 0
    /// to 3 points. Curves are approximated by chords.
    void add_composite(PointTable& table) const {
        const std::uint64_t count = bytes_.at<std::uint32_t>(36);
        (void)bytes_.part(kHeader, 4 * count);
        const double z = required_slice();
        constexpr int kChords = 8;
        std::vector<Vec3> line;
        const auto finish = [&] {
            if (line.size() > 1 && line.front() == line.back()) line.pop_back();
            if (!line.empty()) add_line(table, line, true, name_);
            line.clear();
        };
        for (std::uint64_t n = 0; n < count;) {
            const double segment = real(kHeader + 4 * n++);
            if (segment == 4) continue;  // the segment type "close" is ignored, because all outlines are closed
            if (segment != 0 && segment != 1 && segment != 2 && segment != 3)
                fail(path_, "ROI " + quote(name_) + ": expected a path segment of type 0 to 4, got " +
                                std::to_string(segment));
            const std::uint64_t points = segment < 2 ? 1 : std::uint64_t(segment);
            if (2 * points > count - n) fail(path_, "ROI " + quote(name_) + ": its path is truncated");
            std::vector<Vec3> given;
            for (std::uint64_t i = 0; i < points; ++i, n += 2)
                given.push_back({real(kHeader + 4 * n) - 0.5, real(kHeader + 4 * n + 4) - 0.5, z});
            if (segment == 0) finish();
            if (segment >= 2 && !line.empty()) {
                // Points on the Bezier curve, computed by de Casteljau's algorithm.
                given.insert(given.begin(), line.back());
                for (int c = 1; c < kChords; ++c) {
                    std::vector<Vec3> control = given;
                    for (std::size_t left = control.size() - 1; left > 0; --left)
                        for (std::size_t i = 0; i < left; ++i)
                            for (int a = 0; a < 2; ++a)
                                control[i][a] += (control[i + 1][a] - control[i][a]) * c / kChords;
                    line.push_back(control[0]);
                }
            }
            line.push_back(given.back());
        }
        finish();
    }

    using string_view = std::string_view;
    const std::string& path_;
    Bytes bytes_;
    std::string name_;
    int version_ = 0, type_ = 0, subtype_ = 0;
    bool sub_pixel_ = false;
    std::uint64_t second_ = 0;  ///< position of the second header; 0 if there is none
};

/// Collects the points of several ROIs in a table. PointTable::rule lists the types of the ROIs with their numbers.
class RoiCollector {
public:
    RoiCollector(const std::string& path, const std::string& structures_by)
        : path_(path), structures_by_(structures_by) {}
    void add(const std::string& name, std::string_view data) {
        const Roi roi(path_, name, data);
        ++kinds_[roi.add_to(table_, structures_by_) ? roi.kind() : "without marks, skipped"];
    }
    [[nodiscard]] PointTable finish() {
        table_.space = PointSpace::Index;
        table_.order = PointOrder::XYZ;
        table_.rule = "Fiji ROIs (";
        for (const auto& [kind, count] : kinds_)
            table_.rule += (table_.rule.back() == '(' ? "" : ", ") + std::to_string(count) + " " + kind;
        table_.rule += "), slices from 1, areas by pixel corners, lines and points by pixel centres";
        return std::move(table_);
    }

private:
    const std::string &path_, &structures_by_;
    PointTable table_;
    std::map<std::string, int> kinds_;
};

}  // namespace

PointTable parse_roi(const std::string& path, const std::string& bytes, const std::string& name,
                     const std::string& structures_by) {
    RoiCollector rois(path, structures_by);
    rois.add(name, bytes);
    return rois.finish();
}

PointTable parse_roi_zip(const std::string& path, const std::string& bytes, const std::string& structures_by) {
    RoiCollector rois(path, structures_by);
    bool any = false;
    for_each_in_zip(
        path, bytes, [](const std::string& name) { return lower(name).ends_with(".roi"); },
        [&](const std::string& name, const std::string& content) {
            any = true;
            rois.add(name.substr(0, name.size() - 4), content);
        });
    if (!any) fail(path, "expected Fiji ROIs in the archive, got none");
    return rois.finish();
}

}  // namespace covol::detail
