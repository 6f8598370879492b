#pragma once
#include <memory>
#include <string>

#include "covol/run.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {

/// The pages of a TIFF as one 3D image, straight through libtiff: ITK drops the spacing that ImageJ and OME store, and
/// reads no hyperstacks. Pages are z unless the description says otherwise (see tiff_stack.h). Samples of a pixel
/// (colour) are channels.
/// @param axes  as rename_axes() has it
std::unique_ptr<ImageFile> open_tiff(const std::string& path, const std::string& axes, const RunContext& run);

}  // namespace covol::detail
