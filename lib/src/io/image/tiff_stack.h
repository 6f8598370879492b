#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// How the pages of a TIFF, or of several, make up an image; from ImageJ's, OME's or tifffile's description.
struct TiffStack {
    /// A page of one of the files; `page` counts the full-resolution directories.
    struct Plane {
        static constexpr std::uint32_t kNone = 0xFFFFFFFF;
        std::uint32_t file = 0;
        std::uint32_t page = kNone;
    };

    std::string format = "TIFF";
    std::uint64_t slices = 0, channels = 1, frames = 1;
    std::string order = "CZT";  ///< fastest first
    Vec3 spacing{0, 0, 0};      ///< 0: the file does not say
    Vec3 origin{0, 0, 0};
    std::string unit;
    std::vector<std::string> channel_names;
    std::vector<std::string> files;         ///< paths; the first is the file itself
    std::vector<std::string> descriptions;  ///< paths of files with OME's description of this one
    std::vector<Plane> planes;  ///< where pages are not simply in order: slices * channels * frames, else empty
    std::vector<std::pair<std::string, std::string>> fields;  ///< what was used of the header
    std::vector<std::string> warnings;

    /// The plane's number in `order`.
    [[nodiscard]] std::uint64_t number(std::uint64_t z, std::uint64_t c, std::uint64_t t) const;
    [[nodiscard]] Plane plane(std::uint64_t z, std::uint64_t c, std::uint64_t t) const;
};

/// What is known of the file itself.
struct TiffFacts {
    std::string path;
    std::string description;            ///< tag 270 of the first page
    std::uint64_t pages = 0;            ///< full-resolution ones
    std::array<float, 2> resolution{};  ///< pixels per unit along x and y; 0: none
    int resolution_unit = 1;            ///< 1: none, 2: inch, 3: cm
    /// Counts the pages of another file of the same image. @throws Error.
    std::function<std::uint64_t(const std::string& path)> count_pages;
};

/// Plain TIFFs carry dots per inch of a scanner or nothing, so their spacing stays unknown.
/// @throws Error InvalidInput, Io (a file of a set is missing).
TiffStack describe_tiff(const TiffFacts& facts);

/// The axes of more than one plane, slowest first: "TC".
std::string plane_axes(const TiffStack& stack);

/// Renames the axes of more than one plane, or makes slices of all planes.
/// @param axes  slowest first, as "ZCYX" or "ZYX"; empty: as the file says
/// @throws Error InvalidInput.
void rename_axes(const std::string& path, const std::string& axes, TiffStack& stack);

/// images= of ImageJ's description, 1 without it.
std::uint64_t imagej_images(const std::string& description);

}  // namespace covol::detail
