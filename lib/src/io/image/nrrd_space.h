#pragma once
#include "io/image/text_header.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {

/// Sets spacing, origin, direction and unit from the fields `space`, `space directions`, `space origin`, `space units`
/// and `units`, because Debian's ITK reverses the wrong axis of a left-anterior-superior space, and ignores units.
/// Lengths are converted to the unit of the first axis. If this is not possible for an axis because a unit is unknown,
/// a warning is reported and the axis has no spacing.
void restore_nrrd_space(const std::string& path, const TextHeader& header, ImageInfo& info, const RunContext& run);

}  // namespace covol::detail
