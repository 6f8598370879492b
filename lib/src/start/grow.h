#pragma once
// A start that has no edge at hand grows until it meets one.
#include <string>

#include "covol/domain.h"
#include "covol/image.h"
#include "covol/run.h"

namespace covol::detail {

struct GrownStart {
    FloatGridPtr level_set;  ///< on the start's domain, active in a band; null where the start is to be used as it is
    std::string why;         ///< one line for people, either way
};

/// Where the image inside a start is as it is on its surface, a front sets out from there. It is slow where the image
/// differs from the inside, so that it arrives everywhere within an object before it leaves it (Malladi, Sethian and
/// Vemuri, IEEE PAMI 17, 1995; Cohen and Kimmel, IJCV 24, 1997), and of all its positions that one is taken where the
/// image changes most across it, on the mean over the front.
/// @param start  negative inside, as the starts of band.h
/// @param sigma  of the Gaussian that the image is seen through, world units
[[nodiscard]] GrownStart grow_to_edges(const Image& image, const FloatGrid& start, double sigma, const RunContext& run);

}  // namespace covol::detail
