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

/// Advice, for messages, to choose a segment by its name, if the file has at least two segments; otherwise empty.
std::string advice_on_segments(const std::string& path);

}  // namespace covol::detail
