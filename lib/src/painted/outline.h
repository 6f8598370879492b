#pragma once
#include <cstdint>
#include <vector>

#include "contours/slice_field.h"

namespace covol::painted {

/// A slice of one label: i fastest.
struct Slice {
    int nx = 0, ny = 0;
    std::vector<std::uint8_t> inside;
    [[nodiscard]] bool at(int i, int j) const {
        return i >= 0 && j >= 0 && i < nx && j < ny && inside[std::size_t(j) * std::size_t(nx) + std::size_t(i)] != 0;
    }
};

/// Closed lines between the voxels inside and the others, in voxels (centres at integers), through the midpoints
/// between neighbours; voxels that touch at a corner are separate. The inside lies to the left.
[[nodiscard]] std::vector<detail::Polygon> pixel_outlines(const Slice& slice);

/// A line through the middle of a staircase: each coordinate is fitted by a quadratic over its neighbours along the
/// line (Savitzky and Golay, Anal. Chem. 36, 1964), which preserves circles. No vertex moves by more than half a voxel
/// along either axis.
[[nodiscard]] detail::Polygon smoothed(const detail::Polygon& outline);

/// The outlines of a slice that is part of an image: smoothed as if the paint continued beyond the image's end on the
/// sides where it reaches it, and cut half a voxel beyond the last centres.
/// @param ends  whether i = 0, i = nx - 1, j = 0, j = ny - 1 are the image's ends
[[nodiscard]] std::vector<detail::Polygon> outlines(const Slice& slice, const std::array<bool, 4>& ends);

/// A connected patch of a slice (neighbours by edge or corner).
struct Patch {
    std::size_t area = 0;  ///< voxels
    int width = 0;         ///< at its widest position, voxels
    bool stroke = false;   ///< at most 4 voxels wide and 6 times as long
};
[[nodiscard]] std::vector<Patch> patches(const Slice& slice);

}  // namespace covol::painted
