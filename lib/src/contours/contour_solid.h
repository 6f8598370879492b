#pragma once
#include <vector>

#include "contours/slice_field.h"
#include "covol/contours.h"

namespace covol::detail {

/// Right-angled coordinates (x, y, w) of world length along an image's axes: w is the slices' normal.
struct SliceFrame {
    ImageGeometry geometry;
    int axis = 2;  ///< the slices' normal: i, j or k
    [[nodiscard]] int x_axis() const { return axis == 0 ? 1 : 0; }
    [[nodiscard]] int y_axis() const { return axis == 2 ? 1 : 2; }
    [[nodiscard]] Vec3 from_index(const Vec3& index) const {
        return {index[x_axis()] * geometry.spacing[x_axis()], index[y_axis()] * geometry.spacing[y_axis()],
                index[axis] * geometry.spacing[axis]};
    }
    [[nodiscard]] Vec3 from_world(const Vec3& world) const { return from_index(geometry.world_to_index(world)); }
    [[nodiscard]] Vec3 to_world(const Vec3& frame) const {
        Vec3 index;
        index[x_axis()] = frame[0] / geometry.spacing[x_axis()];
        index[y_axis()] = frame[1] / geometry.spacing[y_axis()];
        index[axis] = frame[2] / geometry.spacing[axis];
        return geometry.index_to_world(index);
    }
};

/// A slice with closed contours.
struct SolidSlice {
    double w = 0;              ///< where it lies along the normal
    std::vector<float> level;  ///< signed distance within the plane, on the grid
    std::size_t polygons = 0;
    double area = 0;    ///< inside
    double depth = 0;   ///< of the deepest node inside
    double cap = 0;     ///< height of the dome, on the first and the last slice; of what goes on where there is none
    bool open = false;  ///< no dome: the image ends here, and the body goes on beyond it as its sections tell
    Vec2 shift{0, 0};   ///< to the next slice's section, where the two do not overlap

    [[nodiscard]] double at(const SliceGrid& grid, double x, double y) const { return sample_slice(level, grid, x, y); }
};

}  // namespace covol::detail

namespace covol {

struct ContourSolid::Data {
    detail::SliceFrame frame;
    detail::SliceGrid grid;
    std::vector<detail::SolidSlice> slices;  ///< by w, at least one
};

}  // namespace covol
