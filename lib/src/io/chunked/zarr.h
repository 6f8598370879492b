#pragma once
#include <memory>
#include <string>

#include "io/pixels/raw_image.h"

// Zarr arrays and OME-Zarr images: folders of files, each of which holds one or several chunks of the image.
namespace covol::detail {

/// Whether a folder is an array or a group of a Zarr store: it holds .zarray, .zgroup, .zattrs or zarr.json.
bool is_zarr(const std::string& folder);

/// An array of Zarr 2 or 3, or an image of OME-Zarr 0.1 to 0.5. If `path` is the group of an image, level 0 is read; if
/// it is the folder of a level, that level is read, with its own spacing and origin. @param correct_level_shift  as in
/// ReadImageOptions
/// @throws Error InvalidInput (damaged), Io, Unsupported (codecs, types; a group of several images: lists them).
std::unique_ptr<ImageFile> open_zarr(const std::string& path, bool correct_level_shift, const RunContext& run);

}  // namespace covol::detail
