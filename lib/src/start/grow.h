#pragma once
// Growth of a start that has no edges nearby, until it reaches edges.
#include <string>

#include "covol/domain.h"
#include "covol/image.h"
#include "covol/run.h"

namespace covol::detail {

struct GrownStart {
    FloatGridPtr level_set;  ///< on the start's domain, active in a band; null if the start is to be used unchanged
    std::string why;         ///< why the start was grown or not, one line for the user
};

/// Expands a start that lies inside an object: if the image is the same inside the start and on its surface, a front
/// begins there. It is slow where the image differs from the inside, so that it fills the object before it leaves it
/// (Malladi, Sethian and Vemuri, IEEE PAMI 17, 1995; Cohen and Kimmel, IJCV 24, 1997). The position of the front with
/// the largest mean change of the image across it is returned.
/// @param start  a level set, negative inside, such as those of start.h
/// @param sigma  standard deviation of the Gaussian with which the image is smoothed, world units
[[nodiscard]] GrownStart grow_to_edges(const Image& image, const FloatGrid& start, double sigma, const RunContext& run);

}  // namespace covol::detail
