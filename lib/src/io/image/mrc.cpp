// MRC2014 and CCP4 maps: https://www.ccpem.ac.uk/mrc_format/mrc2014.php
#include <array>
#include <cmath>
#include <cstring>

#include "io/image/image_formats.h"

namespace covol::detail {
namespace {

constexpr std::uint64_t kHeaderBytes = 1024;
// Byte positions of header fields.
constexpr int kSize = 0, kMode = 12, kStart = 16, kSampling = 28, kCell = 40, kAngles = 52, kAxes = 64, kMin = 76;
constexpr int kMax = 80, kSpaceGroup = 88, kExtended = 92, kImodStamp = 152, kImodFlags = 156, kOrigin = 196;
constexpr int kVolumeStack = 401;
constexpr std::int32_t kImod = 1146047817;

class Header {
public:
    explicit Header(const std::string& path) {
        PixelPlace begin;
        begin.path = path;
        if (!read_bytes(begin, kHeaderBytes, bytes_.data()))
            throw read_error(Errc::InvalidInput, path, "damaged, truncated, or not an MRC file (its header is short)");
        swap_ = !is_sound();
        if (!is_sound()) throw read_error(Errc::InvalidInput, path, "damaged, or not an MRC file");
    }
    [[nodiscard]] std::int32_t integer(int at) const { return load<std::int32_t>(at); }
    [[nodiscard]] float number(int at) const { return load<float>(at); }
    [[nodiscard]] bool swap() const { return swap_; }

private:
    template <typename T>
    [[nodiscard]] T load(int at) const {
        T value;
        std::memcpy(&value, bytes_.data() + at, sizeof(T));
        if (swap_) swap_bytes(&value, 1, sizeof(T));
        return value;
    }
    /// Whether the byte order `swap_` is plausible: with the wrong byte order, the small numbers of the header would be
    /// huge or negative.
    [[nodiscard]] bool is_sound() const {
        constexpr std::int32_t kHuge = 1 << 24;
        bool sound = integer(kMode) >= 0 && integer(kMode) < 128 && integer(kExtended) >= 0;
        for (int a = 0; a < 3; ++a) sound = sound && integer(kSize + 4 * a) > 0 && integer(kSize + 4 * a) < kHuge;
        return sound;
    }

    std::array<char, kHeaderBytes> bytes_{};
    bool swap_ = false;
};

void set_type(const std::string& path, const Header& header, ImageInfo& info, PixelPlace& place) {
    switch (header.integer(kMode)) {
        case 0: {
            // MRC2014 prescribes signed bytes. IMOD's files have unsigned bytes unless a flag is set. Other files have
            // unsigned bytes if their minimum is at least 0 and their maximum exceeds 127.
            const bool imod = header.integer(kImodStamp) == kImod;
            const bool is_unsigned =
                imod ? (header.integer(kImodFlags) & 1) == 0 : header.number(kMin) >= 0 && header.number(kMax) > 127;
            place.type = is_unsigned ? PixelType::UInt8 : PixelType::Int8;
            break;
        }
        case 1: place.type = PixelType::Int16; break;
        case 2: place.type = PixelType::Float; break;
        case 6: place.type = PixelType::UInt16; break;
        case 12:
            place.type = PixelType::Float;
            place.half = true;
            break;
        default:
            throw read_error(Errc::Unsupported, path,
                             "expected MRC mode 0, 1, 2, 6 or 12, got mode " + std::to_string(header.integer(kMode)));
    }
    info.type = place.type;
}

/// The world axes along the file's columns, rows and sections. @throws Error InvalidInput.
std::array<int, 3> axes_of(const std::string& path, const Header& header) {
    std::array<int, 3> axes{};
    int seen = 0;
    for (int a = 0; a < 3; ++a) {
        axes[a] = header.integer(kAxes + 4 * a);
        if (axes[a] >= 1 && axes[a] <= 3) seen |= 1 << axes[a];
    }
    // Old programs write zeros, which mean the order x, y, z.
    if (axes == std::array<int, 3>{0, 0, 0}) return {0, 1, 2};
    if (seen != 0b1110)
        throw read_error(Errc::InvalidInput, path,
                         "expected MAPC, MAPR and MAPS to be 1, 2 and 3 in some order; the header is damaged");
    for (int& axis : axes) --axis;
    return axes;
}

void set_geometry(const std::string& path, const Header& header, ImageInfo& info) {
    ImageGeometry& geometry = info.geometry;
    geometry.unit = "angstrom";
    geometry.direction = {};
    const std::array<int, 3> axes = axes_of(path, header);
    bool has_origin = false;
    for (int w = 0; w < 3; ++w) {
        geometry.origin[w] = header.number(kOrigin + 4 * w);
        has_origin = has_origin || geometry.origin[w] != 0;
        const float angle = header.number(kAngles + 4 * w);
        if (angle != 0 && !(std::abs(angle - 90) < 0.01F))
            throw read_error(Errc::Unsupported, path,
                             "expected a cell with right angles, got " + std::to_string(angle));
    }
    std::string order;
    for (int a = 0; a < 3; ++a) {
        const int w = axes[a];
        order += "XYZ"[w];
        geometry.direction[w][a] = 1;
        const double cell = header.number(kCell + 4 * w), sampling = header.integer(kSampling + 4 * w);
        info.spacing_known[a] = cell > 0 && sampling > 0;
        geometry.spacing[a] = info.spacing_known[a] ? cell / sampling : 1;
        if (!has_origin) geometry.origin[w] = header.integer(kStart + 4 * a) * geometry.spacing[a];
    }
    info.axis_order = order;
    info.fields = {{"CELLA/MX", "the spacing, in angstrom"},
                   {has_origin ? "ORIGIN" : "NXSTART NYSTART NZSTART", "the origin"},
                   {"MAPC MAPR MAPS", order},
                   {"MODE", std::to_string(header.integer(kMode))}};
}

}  // namespace

std::unique_ptr<ImageFile> open_mrc(const std::string& path) {
    const Header header(path);
    ImageInfo info;
    info.format = "MRC";
    PixelPlace place;
    place.path = path;
    place.file_offset = kHeaderBytes + std::uint64_t(header.integer(kExtended));
    set_type(path, header, info, place);
    place.swap = header.swap() && place.stored_bytes() > 1;
    std::uint64_t size[3];
    for (int a = 0; a < 3; ++a) size[a] = std::uint64_t(header.integer(kSize + 4 * a));
    const std::int32_t sections = header.integer(kSampling + 8);
    if (header.integer(kSpaceGroup) >= kVolumeStack && sections > 0 && size[2] % std::uint64_t(sections) == 0) {
        info.frames = static_cast<int>(size[2] / std::uint64_t(sections));
        size[2] = std::uint64_t(sections);
    }
    info.geometry.size = require_3d(path, size);
    set_geometry(path, header, info);
    return open_placed(path, info, place);
}

}  // namespace covol::detail
