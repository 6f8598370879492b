#pragma once
#include "covol/clip.h"
#include "covol/domain.h"
#include "covol/run.h"

namespace covol::detail {

/// A start whose body is continued beyond the image's end up to the end of the domain. The domain of an image that is
/// rotated against the world contains positions outside of it; a surface that ended there would be pulled inward by its
/// curvature, because nothing holds it.
/// @param start   a start like those of start.h, on `domain`
/// @param image   the image's box, rotated like the image
/// @return null if nothing of the start remains
[[nodiscard]] FloatGridPtr carried_beyond(const FloatGrid& start, const Domain& domain, const Clip& image,
                                          const RunContext& run);

}  // namespace covol::detail
