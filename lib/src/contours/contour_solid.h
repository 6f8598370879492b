#pragma once
#include <vector>

#include "base/matrix.h"
#include "contours/slice_field.h"
#include "covol/contours.h"

namespace covol::detail {

/// Orthogonal coordinates (x, y, w) with world lengths along an image's axes: w is the slices' normal.
class SliceFrame {
public:
    SliceFrame() = default;
    /// @param axis  the slices' normal: i, j or k
    SliceFrame(const ImageGeometry& geometry, int axis)
        : geometry_(geometry), axis_(axis), to_axes_(inverse(geometry.direction)) {}

    [[nodiscard]] int axis() const { return axis_; }
    [[nodiscard]] int x_axis() const { return axis_ == 0 ? 1 : 0; }
    [[nodiscard]] int y_axis() const { return axis_ == 2 ? 1 : 2; }
    [[nodiscard]] Vec3 from_index(const Vec3& index) const {
        const Vec3& spacing = geometry_.spacing;
        return ordered({index[0] * spacing[0], index[1] * spacing[1], index[2] * spacing[2]});
    }
    [[nodiscard]] Vec3 from_world(const Vec3& world) const {
        const Vec3& o = geometry_.origin;
        return ordered(multiply(to_axes_, {world[0] - o[0], world[1] - o[1], world[2] - o[2]}));
    }
    [[nodiscard]] Vec3 to_world(const Vec3& frame) const {
        Vec3 index;
        index[x_axis()] = frame[0] / geometry_.spacing[x_axis()];
        index[y_axis()] = frame[1] / geometry_.spacing[y_axis()];
        index[axis_] = frame[2] / geometry_.spacing[axis_];
        return geometry_.index_to_world(index);
    }

private:
    [[nodiscard]] Vec3 ordered(const Vec3& along) const { return {along[x_axis()], along[y_axis()], along[axis_]}; }

    ImageGeometry geometry_;
    int axis_ = 2;
    Matrix3 to_axes_ = ImageGeometry{}.direction;
};

/// A slice with closed contours.
struct SolidSlice {
    double w = 0;              ///< position along the normal
    std::vector<float> level;  ///< signed distance within the plane, on the grid
    std::size_t polygons = 0;
    double area = 0;   ///< area of the inside
    double depth = 0;  ///< maximum distance of a node inside from the contours
    double cap = 0;  ///< first and last slice: height of the dome, or height up to which an open end has surface points
    /// First and last slice: there is no dome, because the image ends here. The body continues beyond the image with
    /// the slope of its lateral surface between the last two sections.
    bool open = false;
    double end = 0;      ///< height at which an open end is cut off, so far outside that no narrow band reaches it
    bool apart = false;  ///< this section and the next slice's do not overlap
    Vec2 shift{0, 0};    ///< translation of this section to the next slice's; 0: none

    [[nodiscard]] double at(const SliceGrid& grid, const SlicePlace& place) const {
        return sample_slice(level, grid, place);
    }
    /// Height beyond the first or last slice at which the body ends.
    [[nodiscard]] double highest() const { return open ? end : cap; }
};

}  // namespace covol::detail

namespace covol {

struct ContourSolid::Data {
    detail::SliceFrame frame;
    detail::SliceGrid grid;
    std::vector<detail::SolidSlice> slices;  ///< sorted by w; at least one
};

}  // namespace covol
