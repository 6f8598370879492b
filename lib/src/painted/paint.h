#pragma once
// The paint of one label, as a whole and by slice.
#include <array>
#include <cstdint>
#include <vector>

#include "covol/image.h"
#include "painted/outline.h"

namespace covol::painted {

/// The paint of one label: which voxels in a box have the label.
class Paint {
public:
    Paint(const Image& labels, int label, const VoxelBox& box);

    std::size_t voxels = 0;

    [[nodiscard]] const VoxelBox& box() const { return box_; }
    [[nodiscard]] const Index3& image_size() const { return image_; }

    /// @param number  of the slice along the axis, counted from the image's first slice
    [[nodiscard]] Slice slice(int axis, int number) const;
    /// Whether the four sides of the box that bound a slice across the axis are ends of the image, in the order of
    /// outlines().
    [[nodiscard]] std::array<bool, 4> ends(int axis) const;
    void erase(int axis, int number);
    /// Positions, in voxels of the image, of the voxels that have a neighbour outside.
    [[nodiscard]] std::vector<Vec3> outer() const;
    /// The connected parts (neighbours by face, edge or corner), each in its own box.
    [[nodiscard]] std::vector<Paint> pieces() const;

    static std::array<int, 2> plane(int axis) { return {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2}; }

private:
    /// Paint that consists of the given voxels, at least one. @param image  size of the image
    Paint(const Index3& image, const std::vector<Index3>& voxels);

    [[nodiscard]] std::size_t at(const Index3& p) const {
        return (std::size_t(p[2]) * std::size_t(n_[1]) + std::size_t(p[1])) * std::size_t(n_[0]) + std::size_t(p[0]);
    }
    [[nodiscard]] bool holds(const Index3& p) const;
    [[nodiscard]] bool is_enclosed(const Index3& p) const;

    VoxelBox box_;
    Index3 n_;
    Index3 image_;
    std::vector<std::uint8_t> inside_;
};

/// Properties of the slices across one axis.
struct AxisPaint {
    std::vector<int> areas;           ///< slices with an area, a patch that is no stroke and wider than 2 voxels
    std::vector<int> painted;         ///< numbers of the slices with any paint
    std::vector<std::size_t> voxels;  ///< number of painted voxels, by painted slice
    std::vector<char> small;          ///< by painted slice: whether all patches are neither areas nor strokes
    int widest = 0;                   ///< width of the widest area, voxels
    int longest_run = 0;              ///< largest number of adjacent slices with an area
};
[[nodiscard]] AxisPaint properties_across(const Paint& paint, int axis);

}  // namespace covol::painted
