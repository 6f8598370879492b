#pragma once
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "covol/points.h"
#include "support/scratch.h"

// Files of marking programs, byte by byte according to their specifications.
namespace covol::test {

class Writer {
public:
    explicit Writer(bool big) : big_(big) {}
    template <typename T>
    Writer& put(T value) {
        std::array<char, sizeof(T)> bytes;
        std::memcpy(bytes.data(), &value, sizeof(T));
        if (big_) std::reverse(bytes.begin(), bytes.end());
        text_.append(bytes.data(), sizeof(T));
        return *this;
    }
    template <typename T>
    Writer& put_at(std::size_t at, T value) {
        const std::string tail = text_.size() > at + sizeof(T) ? text_.substr(at + sizeof(T)) : "";
        text_.resize(at, '\0');
        put(value);
        text_ += tail;
        return *this;
    }
    Writer& put(const std::string& text) {
        text_ += text;
        return *this;
    }
    Writer& pad(std::size_t size) {
        text_.resize(size, '\0');
        return *this;
    }
    [[nodiscard]] std::size_t size() const { return text_.size(); }
    [[nodiscard]] const std::string& text() const { return text_; }

private:
    bool big_;
    std::string text_;
};

enum RoiType : std::uint8_t {
    kPolygon = 0,
    kRectangle = 1,
    kOval = 2,
    kLine = 3,
    kFreeLine = 4,
    kPolyline = 5,
    kFreehand = 7,
    kTraced = 8,
    kPoint = 10
};

struct RoiSpec {
    RoiType type = kPolygon;
    std::vector<std::array<float, 2>> xy;
    bool sub_pixel = true;
    std::vector<int> positions;  ///< slice of each point, from 1
    int position = 0, z = 0, channel = 0;
    std::string name;
    std::array<float, 4> box{};  ///< x, y, width and height, or the two ends of a line
    std::vector<float> path;     ///< the path of a composite ROI
};

inline std::string roi(const RoiSpec& spec) {
    const std::size_t n = spec.xy.size();
    const bool has_box = spec.type == kRectangle || spec.type == kOval || spec.type == kLine;
    const float left = has_box ? spec.box[0] : 5, top = has_box ? spec.box[1] : 6;
    Writer w(true);
    w.put(std::string("Iout")).put(std::int16_t(228)).put(std::uint8_t(spec.type)).put(std::uint8_t(0));
    w.put(std::int16_t(top))
        .put(std::int16_t(left))
        .put(std::int16_t(top + spec.box[3]))
        .put(std::int16_t(left + spec.box[2]));
    w.put(std::uint16_t(n));
    if (has_box && spec.sub_pixel)
        for (const float v : spec.box) w.put(v);
    w.pad(36).put(std::int32_t(spec.path.size())).pad(50);
    w.put(std::int16_t(spec.sub_pixel ? 128 : 0)).pad(56).put(std::int32_t(spec.position));
    const std::size_t second = 64 + 4 * spec.path.size() + (spec.sub_pixel ? 12 : 4) * n;
    w.put(std::int32_t(second));
    for (const float v : spec.path) w.put(v);
    for (int a = 0; a < 2; ++a)
        for (const auto& p : spec.xy) w.put(std::int16_t(p[std::size_t(a)] - (a == 0 ? left : top)));
    if (spec.sub_pixel)
        for (int a = 0; a < 2; ++a)
            for (const auto& p : spec.xy) w.put(p[std::size_t(a)]);
    w.pad(second + 4).put(std::int32_t(spec.channel)).put(std::int32_t(spec.z)).put(std::int32_t(0));
    w.put(std::int32_t(spec.name.empty() ? 0 : second + 64)).put(std::int32_t(spec.name.size()));
    const std::size_t counters = second + 64 + 2 * spec.name.size();
    w.pad(second + 48).put(std::int32_t(spec.positions.empty() ? 0 : counters)).pad(second + 64);
    for (const char c : spec.name) w.put(std::int16_t(c));
    for (const int position : spec.positions) w.put(std::int32_t(position << 8 | 3));
    return w.text();
}

inline const std::vector<Vec3> kIndex{{10, 20, 3}, {12.5, 20.25, 3}, {12.5, 31, 3}, {10.25, 31.75, 4}};

/// Markers of Fiji's Cell Counter, in types of two markers, followed by an empty type.
inline std::string cell_counter(const std::vector<Vec3>& points, bool named = false) {
    std::string text =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\r\n<CellCounter_Marker_File>\r\n <Image_Properties>\r\n"
        "     <Image_Filename>a.tif</Image_Filename>\r\n </Image_Properties>\r\n <Marker_Data>\r\n"
        "     <Current_Type>0</Current_Type>\r\n";
    for (std::size_t type = 0; 2 * type <= points.size(); ++type) {
        text += "     <Marker_Type>\r\n         <Type>" + std::to_string(type + 1) + "</Type>\r\n";
        if (named) text += "         <Name>cell &lt;" + std::to_string(type + 1) + "&gt;</Name>\r\n";
        for (std::size_t n = 2 * type; n < std::min(points.size(), 2 * type + 2); ++n)
            text += "         <Marker>\r\n             <MarkerX>" + std::to_string(points[n][0]) +
                    "</MarkerX>\r\n             <MarkerY>" + std::to_string(points[n][1]) +
                    "</MarkerY>\r\n             <MarkerZ>" + std::to_string(int(points[n][2]) + 1) +
                    "</MarkerZ>\r\n         </Marker>\r\n";
        text += "     </Marker_Type>\r\n";
    }
    return text + " </Marker_Data>\r\n</CellCounter_Marker_File>\r\n";
}

/// The marks of one slice as the outline of an area, in coordinates of pixel corners.
inline RoiSpec outline(RoiType type, int slice) {
    RoiSpec spec;
    spec.type = type;
    for (const Vec3& p : kIndex)
        if (p[2] == slice) spec.xy.push_back({float(p[0] + 0.5), float(p[1] + 0.5)});
    spec.position = slice + 1;
    spec.name = "outline";
    return spec;
}

inline std::string read_error(const Scratch& scratch, const std::string& name, const std::string& content) {
    const std::string path = scratch.write(name, content);
    return message_of([&] { (void)read_points(path); });
}

inline void contains(const std::string& message, const std::string& part) {
    INFO(message);
    CHECK(message.find(part) != std::string::npos);
}

}  // namespace covol::test
