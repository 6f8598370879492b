#pragma once
#include "covol/clip.h"
#include "covol/domain.h"
#include "covol/run.h"

namespace covol::detail {

/// A start whose body goes on beyond the image as it is at its end, as far as the domain reaches: the domain of an
/// image that is turned against the world holds places outside of it, where a surface that ended there would be pulled
/// in by its curvature, for nothing holds it.
/// @param start   a start as those of start.h, on `domain`
/// @param image   the image's box, turned as it is
/// @return null where nothing of the start is left
[[nodiscard]] FloatGridPtr carried_beyond(const FloatGrid& start, const Domain& domain, const Clip& image,
                                          const RunContext& run);

}  // namespace covol::detail
