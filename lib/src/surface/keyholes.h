#pragma once
#include <array>
#include <vector>

// Conversion of plane regions with holes to single curves.
namespace covol::detail {

using PlanePoint = std::array<double, 2>;

/// Connects each hole to the part that contains it, by a channel of zero width between their nearest points.
/// @param curves  closed, without intersections, and with the inside on their left, so that parts have a positive area
/// and holes a negative one
/// @returns the parts, with their holes, in the order of `curves`
std::vector<std::vector<PlanePoint>> join_holes(std::vector<std::vector<PlanePoint>> curves);

}  // namespace covol::detail
