#pragma once
#include <string>

#include "covol/run.h"
#include "detail/raw_image.h"

namespace covol::detail {

/// Reads the pages of a TIFF as one 3D image, straight through libtiff: ITK drops the spacing that ImageJ and OME
/// store, and reads no hyperstacks. Pages are z unless ImageJ's or OME's description says channels or frames.
/// Spacing comes from the description and, with it, the resolution tags; plain TIFFs carry dots per inch of a
/// scanner or nothing, so theirs stays unknown.
/// @param header_only  leave RawImage::data null
RawImage read_tiff(const std::string& path, const ReadImageOptions& options, bool header_only, const RunContext& run);

/// One deflated page per z, spacing and unit as ImageJ has them. TIFF has no place for an origin or a direction.
void write_tiff(const std::string& path, const ImageGeometry& geometry, PixelType type, const void* values);

}  // namespace covol::detail
