#pragma once
#include <optional>
#include <string>
#include <vector>

namespace covol::detail {

/// An axis of an OME-Zarr image.
struct OmeAxis {
    std::string name, type, unit;  ///< unit as returned by normal_unit()
};

/// A level of a pyramid: world = scale * index + translation along each axis of the array.
struct OmeLevel {
    std::string path;  ///< path of the level's array, relative to the group
    std::vector<double> scale, translation;
    bool has_scale = false;
    /// The metadata state a translation of this level itself, not only of the whole pyramid.
    bool has_translation = false;
};

/// The first image of a group, as described by its metadata. https://ngff.openmicroscopy.org/0.5/
struct OmeImage {
    std::string group;     ///< folder of the group
    std::string metadata;  ///< path of the file with the metadata
    std::string version;   ///< for example "0.4"
    int images = 0;        ///< number of images in the group, of which only the first is described here
    std::vector<OmeAxis> axes;
    std::vector<OmeLevel> levels;  ///< the finest first
    std::vector<std::string> channels;
};

/// Reads the metadata of the image in a group. @returns nothing if the folder has no metadata of an image. @throws
/// Error InvalidInput, Io, Unsupported.
std::optional<OmeImage> read_ome_image(const std::string& folder);

/// The image to which an array belongs as a level, and the number of that level. The image's group is one of the three
/// folders above the array.
struct OmePlace {
    OmeImage image;
    std::size_t level = 0;
};
std::optional<OmePlace> find_ome_image(const std::string& array_folder);

/// The contents of a group of a Zarr store that is not an image itself. Messages list them.
struct OmeGroup {
    std::vector<std::string> images;  ///< names of the folders in the group that are images or arrays
    bool is_series = false;           ///< whether the images are named 0, 1, ... as bioformats2raw names them
    bool is_plate = false;
};
OmeGroup read_ome_group(const std::string& folder);

}  // namespace covol::detail
