#pragma once
#include <array>
#include <vector>

// Parts of a plane with holes as single curves.
namespace covol::detail {

using PlanePoint = std::array<double, 2>;

/// Joins each hole to the part that it lies in, by a channel of no width between their nearest points.
/// @param curves  closed, none of which crosses another; with the inside on their left, so that parts have a positive
///                area and holes a negative one
/// @returns the parts in their order
std::vector<std::vector<PlanePoint>> join_holes(std::vector<std::vector<PlanePoint>> curves);

}  // namespace covol::detail
