#pragma once
#include <memory>
#include <string>

#include "io/pixels/raw_image.h"

namespace covol::detail {

/// One segment of a 3D Slicer segmentation as a mask of 0 and 1.
/// @param file  the segmentation, whose channels are its layers
/// @param name  the segment's name, or its ID
/// @throws Error InvalidInput, with the list of names.
std::unique_ptr<ImageFile> open_segment(const std::string& path, std::unique_ptr<ImageFile> file,
                                        const std::string& name);

/// How to choose one of the segments of a file that has several layers, for messages; empty for other files.
std::string advice_on_segments(const std::string& path);

}  // namespace covol::detail
