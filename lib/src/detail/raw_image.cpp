#include "detail/raw_image.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <limits>
#include <new>

#include "covol/error.h"

namespace covol::detail {
namespace {

// Deflate packs at most 1032 : 1 and LZW about 2700 : 1; the newer TIFF codecs go higher on constant slices.
constexpr std::uint64_t kMaxCompression = 20000;

struct Unit {
    const char* name;
    double metres;
};
constexpr Unit kUnits[] = {{"nm", 1e-9}, {"um", 1e-6},     {"mm", 1e-3},     {"cm", 1e-2},
                           {"m", 1.0},   {"inch", 0.0254}, {"angstrom", 1e-10}, {"pm", 1e-12}};

struct Spelling {
    const char* text;
    const char* unit;
};
constexpr Spelling kSpellings[] = {
    {"\xC2\xB5m", "um"},      {"\xCE\xBCm", "um"},     {"\xB5m", "um"},         {"\\u00b5m", "um"},
    {"micron", "um"},         {"microns", "um"},       {"micrometer", "um"},    {"micrometre", "um"},
    {"micrometers", "um"},    {"micrometres", "um"},   {"nanometer", "nm"},     {"nanometre", "nm"},
    {"nanometers", "nm"},     {"millimeter", "mm"},    {"millimetre", "mm"},    {"millimeters", "mm"},
    {"centimeter", "cm"},     {"centimetre", "cm"},    {"meter", "m"},          {"metre", "m"},
    {"in", "inch"},           {"inches", "inch"},      {"\xC3\x85", "angstrom"}, {"pixel", ""},
    {"pixels", ""},           {"voxel", ""},           {"reference frame", ""}};

}  // namespace

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
