#pragma once
#include "io/image/text_header.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {

/// Sets spacing, origin, direction and unit from the header's own `space`, `space directions`, `space origin`, `space
/// units` and `units`, because Debian's ITK flips the wrong axis of a left-anterior-superior space, and ignores units.
/// Lengths are converted to the first axis' unit. An axis of an unknown unit among known ones has no spacing, and a
/// warning is reported.
void restore_nrrd_space(const std::string& path, const TextHeader& header, ImageInfo& info, const RunContext& run);

}  // namespace covol::detail
