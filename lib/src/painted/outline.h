#pragma once
#include <cstdint>
#include <vector>

#include "contours/slice_field.h"

namespace covol::painted {

/// A slice of one label: for each voxel whether it has the label; i varies fastest.
struct Slice {
    int nx = 0, ny = 0;
    std::vector<std::uint8_t> inside;
    [[nodiscard]] bool at(int i, int j) const {
        return i >= 0 && j >= 0 && i < nx && j < ny && inside[std::size_t(j) * std::size_t(nx) + std::size_t(i)] != 0;
    }
};

/// Closed lines around the voxels inside, through the midpoints between each of them and its neighbours outside.
/// Coordinates are in voxels, with the centres at integers. Voxels that touch only at a corner are separated. The
/// inside lies to the left of the line.
[[nodiscard]] std::vector<detail::Polygon> pixel_outlines(const Slice& slice);

/// Smooths the stairs of an outline along voxels: each coordinate of a vertex is fitted by a quadratic over its
/// neighbours along the line (Savitzky and Golay, Anal. Chem. 36, 1964), which preserves circles. No vertex moves by
/// more than half a voxel along either axis.
[[nodiscard]] detail::Polygon smoothed(const detail::Polygon& outline);

/// The smoothed outlines of a slice. Where the paint reaches an end of the image, it is smoothed as if it continued
/// beyond the end, and cut off at the end, half a voxel beyond the last centres.
/// @param ends  whether i = 0, i = nx - 1, j = 0, j = ny - 1 are the image's ends
[[nodiscard]] std::vector<detail::Polygon> outlines(const Slice& slice, const std::array<bool, 4>& ends);

/// A connected patch of a slice (neighbours by edge or corner).
struct Patch {
    std::size_t area = 0;  ///< voxels
    int width = 0;         ///< at its widest position, voxels; widths of 1 and 2 voxels both count as 1
    bool stroke = false;   ///< at most 4 voxels wide and 6 times as long
};
[[nodiscard]] std::vector<Patch> patches(const Slice& slice);

}  // namespace covol::painted
