#include "detail/raw_image.h"

#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <vector>

#include "covol/error.h"

namespace covol::detail {
namespace {

// Deflate packs at most 1032 : 1 and LZW about 2700 : 1; the newer TIFF codecs go higher on constant slices.
constexpr std::uint64_t kMaxCompression = 20000;

struct Unit {
    const char* name;
    double metres;
};
constexpr Unit kUnits[] = {{"nm", 1e-9}, {"um", 1e-6},     {"mm", 1e-3},        {"cm", 1e-2},
                           {"m", 1.0},   {"inch", 0.0254}, {"angstrom", 1e-10}, {"pm", 1e-12}};

struct Spelling {
    const char* text;
    const char* unit;
};
constexpr Spelling kSpellings[] = {
    {"\xC2\xB5m", "um"},   {"\xCE\xBCm", "um"},   {"\xB5m", "um"},          {"\\u00b5m", "um"},
    {"micron", "um"},      {"microns", "um"},     {"micrometer", "um"},     {"micrometre", "um"},
    {"micrometers", "um"}, {"micrometres", "um"}, {"nanometer", "nm"},      {"nanometre", "nm"},
    {"nanometers", "nm"},  {"millimeter", "mm"},  {"millimetre", "mm"},     {"millimeters", "mm"},
    {"centimeter", "cm"},  {"centimetre", "cm"},  {"meter", "m"},           {"metre", "m"},
    {"in", "inch"},        {"inches", "inch"},    {"\xC3\x85", "angstrom"}, {"pixel", ""},
    {"pixels", ""},        {"voxel", ""},         {"reference frame", ""}};

/// An unpacked view of a gzip or zlib stream in a file.
class Inflater {
public:
    explicit Inflater(std::ifstream& file) : file_(file) {
        constexpr int kAnyHeader = 15 + 32;
        good_ = inflateInit2(&stream_, kAnyHeader) == Z_OK;
    }
    ~Inflater() { inflateEnd(&stream_); }
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;

    /// Fills `out`; false when the stream ends before, or is damaged.
    bool read(char* out, std::uint64_t count) {
        while (good_ && count > 0) {
            const std::uint64_t piece = std::min<std::uint64_t>(count, 1U << 30);
            stream_.next_out = reinterpret_cast<Bytef*>(out);
            stream_.avail_out = static_cast<uInt>(piece);
            step();
            const std::uint64_t done = piece - stream_.avail_out;
            out += done;
            count -= done;
        }
        return count == 0;
    }
    /// True unless the checksum behind the last byte that was read is there and wrong.
    bool checksum_fits() {
        char more = 0;
        stream_.next_out = reinterpret_cast<Bytef*>(&more);
        stream_.avail_out = 1;
        if (good_) step();
        return !damaged_;
    }

private:
    void step() {
        if (stream_.avail_in == 0) {
            file_.read(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
            stream_.next_in = reinterpret_cast<Bytef*>(buffer_.data());
            stream_.avail_in = static_cast<uInt>(file_.gcount());
            if (stream_.avail_in == 0) good_ = false;
        }
        const int status = good_ ? inflate(&stream_, Z_NO_FLUSH) : Z_OK;
        // a gzip file may be several streams behind each other
        if (status == Z_STREAM_END)
            good_ = inflateReset(&stream_) == Z_OK;
        else if (status != Z_OK && status != Z_BUF_ERROR) {
            good_ = false;
            damaged_ = true;
        }
    }

    std::ifstream& file_;
    std::vector<char> buffer_ = std::vector<char>(std::size_t(1) << 18);
    z_stream stream_{};
    bool good_ = true;
    bool damaged_ = false;
};

/// From the stored type to the wanted one: out = slope * stored + intercept.
void rescale(const PixelPlace& place, const void* stored, std::uint64_t count, PixelType type, void* out) {
    with_pixel_type(place.type, [&](auto from) {
        with_pixel_type(type, [&](auto to) {
            const auto* source = static_cast<const decltype(from)*>(stored);
            auto* target = static_cast<decltype(to)*>(out);
            if constexpr (std::is_floating_point_v<decltype(to)>)
                for (std::uint64_t n = 0; n < count; ++n)
                    target[n] = static_cast<decltype(to)>(place.slope * double(source[n]) + place.intercept);
        });
    });
}

}  // namespace

bool read_bytes(const PixelPlace& place, std::uint64_t count, void* out) {
    std::ifstream file(place.path, std::ios::binary);
    auto* bytes = static_cast<char*>(out);
    if (!place.packed) {
        file.seekg(static_cast<std::streamoff>(place.file_offset + place.skip));
        return bool(file.read(bytes, static_cast<std::streamsize>(count)));
    }
    file.seekg(static_cast<std::streamoff>(place.file_offset));
    Inflater inflater(file);
    std::vector<char> before(std::min<std::uint64_t>(place.skip, 1U << 16));
    for (std::uint64_t left = place.skip; left > 0;) {
        const std::uint64_t piece = std::min<std::uint64_t>(left, before.size());
        if (!inflater.read(before.data(), piece)) return false;
        left -= piece;
    }
    return inflater.read(bytes, count) && inflater.checksum_fits();
}

bool read_pixels(const PixelPlace& place, std::uint64_t count, PixelType type, void* out) {
    const std::uint64_t width = pixel_bytes(place.type);
    const bool as_stored = place.type == type && place.slope == 1 && place.intercept == 0;
    std::vector<char> stored(as_stored ? 0 : count * width);
    void* target = as_stored ? out : stored.data();
    if (!read_bytes(place, count * width, target)) return false;
    if (place.swap) swap_bytes(target, count, width);
    if (!as_stored) rescale(place, target, count, type, out);
    return true;
}

void swap_bytes(void* data, std::uint64_t count, std::uint64_t width) {
    auto* bytes = static_cast<char*>(data);
    for (std::uint64_t n = 0; n < count; ++n) std::reverse(bytes + n * width, bytes + (n + 1) * width);
}

std::string size_text(const Index3& size) {
    return std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " + std::to_string(size[2]);
}

void require_3d(const std::string& path, const std::uint64_t (&size)[3]) {
    const std::string text =
        std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " + std::to_string(size[2]);
    if (std::min({size[0], size[1], size[2]}) < 2)
        throw Error(Errc::InvalidInput, "read_image: " + path + ": expected a 3D image, got " + text);
    if (std::max({size[0], size[1], size[2]}) > std::uint64_t(std::numeric_limits<std::int32_t>::max()) / 2)
        throw Error(Errc::InvalidInput, "read_image: " + path + ": the header claims " + text + " voxels");
}

std::shared_ptr<void> allocate_pixels(const std::string& path, std::uint64_t voxels, PixelType type,
                                      std::uint64_t file_bytes) {
    const std::uint64_t bytes = voxels * pixel_bytes(type);
    const bool overflow = voxels > std::numeric_limits<std::uint64_t>::max() / 8;
    if (overflow || (file_bytes > 0 && bytes / kMaxCompression > file_bytes))
        throw Error(Errc::InvalidInput, "read_image: " + path + ": the header claims " + std::to_string(voxels) +
                                            " voxels, which a file of " + std::to_string(file_bytes) +
                                            " bytes cannot hold; it is damaged or truncated");
    const std::uint64_t memory = std::uint64_t(::sysconf(_SC_PHYS_PAGES)) * std::uint64_t(::sysconf(_SC_PAGESIZE));
    const auto refuse = [&] {
        return Error(Errc::Unsupported, "read_image: " + path + ": the image needs " + std::to_string(bytes >> 20) +
                                            " MiB, this machine has " + std::to_string(memory >> 20) +
                                            " MiB; crop or downsample it");
    };
    if (bytes > memory) throw refuse();
    // malloc leaves the pages untouched until the reader fills them.
    void* data = std::malloc(std::max<std::uint64_t>(bytes, 1));
    if (data == nullptr) throw refuse();
    return {data, std::free};
}

std::string normal_unit(const std::string& text) {
    std::string unit;
    for (const char c : text)
        if (c != '"' && c != '\r' && c != '\n' && c != '\0')
            unit += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    unit.erase(0, unit.find_first_not_of(" \t"));
    unit.erase(unit.find_last_not_of(" \t") + 1);
    for (const Spelling& s : kSpellings)
        if (unit == s.text) return s.unit;
    return unit;
}

double unit_in_metres(const std::string& normal_unit) {
    for (const Unit& u : kUnits)
        if (normal_unit == u.name) return u.metres;
    return 0;
}

}  // namespace covol::detail
