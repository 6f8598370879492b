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
    Vec3 spacing{0, 0, 0};      ///< 0 if the file does not state it
    Vec3 origin{0, 0, 0};
    std::string unit;
    std::vector<std::string> channel_names;
    std::vector<std::string> files;         ///< paths; the first is the file itself
    std::vector<std::string> descriptions;  ///< paths of files with the OME description of this one
    std::vector<Plane>
        planes;  ///< if pages are not simply in order: slices * channels * frames of them; otherwise empty
    std::vector<std::pair<std::string, std::string>> fields;  ///< the header fields that were used
    std::vector<std::string> warnings;

    /// The index of the plane according to `order`.
    [[nodiscard]] std::uint64_t number(std::uint64_t z, std::uint64_t c, std::uint64_t t) const;
    [[nodiscard]] Plane plane(std::uint64_t z, std::uint64_t c, std::uint64_t t) const;
};

/// The properties of the file itself.
struct TiffFacts {
    std::string path;
    std::string description;            ///< tag 270 of the first page
    std::uint64_t pages = 0;            ///< number of full-resolution pages
    std::array<float, 2> resolution{};  ///< pixels per unit along x and y; 0 if not stated
    int resolution_unit = 1;            ///< 1: none, 2: inch, 3: cm
    /// Counts the pages of another file of the same image. @throws Error.
    std::function<std::uint64_t(const std::string& path)> count_pages;
};

/// Plain TIFFs state at most the resolution of a scanner, so their spacing remains unknown.
/// @throws Error InvalidInput, Io (a file of a set is missing).
TiffStack describe_tiff(const TiffFacts& facts);

/// The axes along which there is more than one plane, slowest first: "TC".
std::string plane_axes(const TiffStack& stack);

/// Renames the axes along which there is more than one plane, or treats all planes as slices.
/// @param axes  slowest first, as "ZCYX" or "ZYX"; empty: as stated by the file
/// @throws Error InvalidInput.
void rename_axes(const std::string& path, const std::string& axes, TiffStack& stack);

/// The number after images= in ImageJ's description; 1 if there is none.
std::uint64_t imagej_images(const std::string& description);

}  // namespace covol::detail
