#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// How the pages of one or several TIFFs form an image, according to the description by ImageJ, OME or tifffile.
struct TiffStack {
    /// A page of one of the files; `page` is the index among the full-resolution directories of the file.
    struct Plane {
        static constexpr std::uint32_t kNone = 0xFFFFFFFF;
        std::uint32_t file = 0;
        std::uint32_t page = kNone;
    };

    std::string format = "TIFF";
    std::uint64_t slices = 0, channels = 1, frames = 1;
    std::string order = "CZT";  ///< the axes of the planes, the fastest first
    Vec3 spacing{0, 0, 0};      ///< 0 along axes for which the file states no spacing
    Vec3 origin{0, 0, 0};
    std::string unit;
    std::vector<std::string> channel_names;
    std::vector<std::string> files;         ///< paths; the first is the file itself
    std::vector<std::string> descriptions;  ///< paths of files that contain the OME description of this file
    std::vector<Plane>
        planes;  ///< the slices * channels * frames planes; empty if the planes are the pages of the file, in its order
    std::vector<std::pair<std::string, std::string>> fields;  ///< the header fields that were used
    std::vector<std::string> warnings;

    /// The index of a plane if the planes are counted along the axes in `order`, the fastest axis first.
    [[nodiscard]] std::uint64_t number(std::uint64_t z, std::uint64_t c, std::uint64_t t) const;
    [[nodiscard]] Plane plane(std::uint64_t z, std::uint64_t c, std::uint64_t t) const;
};

/// The properties of a TIFF that libtiff reports.
struct TiffFacts {
    std::string path;
    std::string description;            ///< tag 270 (ImageDescription) of the first page
    std::uint64_t pages = 0;            ///< number of full-resolution pages
    std::array<float, 2> resolution{};  ///< pixels per unit along x and y; 0 if not stated
    int resolution_unit = 1;            ///< tag ResolutionUnit: 1: none, 2: inch, 3: cm
    /// Counts the pages of another file of the same image. @throws Error.
    std::function<std::uint64_t(const std::string& path)> count_pages;
};

/// Determines how the pages form an image. Without a description by ImageJ, OME or tifffile, the spacing is unknown,
/// because the resolution in a plain TIFF is usually that of a scanner or a screen, not of a microscope.
/// @throws Error InvalidInput, Io (a file of a set is missing).
TiffStack describe_tiff(const TiffFacts& facts);

/// The axes along which there is more than one plane, slowest first, for example "TC".
std::string plane_axes(const TiffStack& stack);

/// Changes the meaning of the axes along which there is more than one plane, or treats all planes as slices.
/// @param axes  slowest first, for example "ZCYX"; "ZYX": all planes are slices; empty: nothing is changed
/// @throws Error InvalidInput.
void rename_axes(const std::string& path, const std::string& axes, TiffStack& stack);

/// The number after images= in ImageJ's description; 1 if there is none.
std::uint64_t imagej_images(const std::string& description);

}  // namespace covol::detail
