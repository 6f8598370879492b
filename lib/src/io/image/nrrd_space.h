#pragma once
#include "io/image/text_header.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {

/// Spacing, origin, direction and unit by the header's own `space`, `space directions`, `space origin`, `space units`
/// and `units`: Debian's ITK turns the wrong axis of a left-anterior-superior space, and knows no units. Lengths are
/// told in the first axis' unit. An axis of an unknown unit among known ones has no spacing, which is a warning.
void restore_nrrd_space(const std::string& path, const TextHeader& header, ImageInfo& info, const RunContext& run);

}  // namespace covol::detail
