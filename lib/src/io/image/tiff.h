#pragma once
#include <memory>
#include <string>

#include "covol/run.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {

/// The pages of a TIFF as one 3D image, read with libtiff directly: ITK drops the spacing that ImageJ and OME store,
/// and does not read hyperstacks. Pages are slices along z unless the description states otherwise (see tiff_stack.h).
/// Samples of a pixel (colour) are channels. @param axes  as in rename_axes()
std::unique_ptr<ImageFile> open_tiff(const std::string& path, const std::string& axes, const RunContext& run);

}  // namespace covol::detail
