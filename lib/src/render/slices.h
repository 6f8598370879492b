#pragma once
// Slices of the image: which ones, and their appearance.
#include <array>
#include <string>
#include <vector>

#include "covol/render.h"
#include "render/draw/canvas.h"

namespace covol::figure {

/// A plane perpendicular to one of the image's axes, with its orientation on the picture.
struct Plane {
    int axis = 2;                                     ///< the axis to which it is perpendicular
    double index = 0;                                 ///< index of the voxels along `axis`
    int across = 0, down = 1;                         ///< axes of the image that run to the right and down
    bool mirror_across = false, mirror_down = false;  ///< whether the index increases to the left, upwards

    friend bool operator==(const Plane&, const Plane&) = default;
};

/// The part of the image that slices show, up to the outer faces of its voxels; indices.
struct Region {
    Vec3 min{0, 0, 0}, max{0, 0, 0};
    /// Length along an axis, world units.
    [[nodiscard]] double length(int axis, const ImageGeometry& geometry) const {
        return (max[axis] - min[axis]) * geometry.spacing[axis];
    }
};

/// The structures and a margin around them. The margin ends at the image's end unless a structure extends beyond it.
[[nodiscard]] Region region_around(const std::vector<WorldBox>& boxes, const ImageGeometry& geometry, double margin);

/// The plane perpendicular to an axis; oriented as in radiology if the axes are anatomical, else along the image's
/// axes.
[[nodiscard]] Plane plane_across(int axis, double index, const RenderScene& scene);

/// The slices on which a person has set marks. They are perpendicular to the axis along which the marks have few
/// different indices, which are integers. If there is no such axis, `axis` is -1.
struct MarkedSlices {
    int axis = -1;
    std::vector<int> slices;  ///< sorted
};
[[nodiscard]] MarkedSlices find_marked_slices(const std::vector<Vec3>& marks, const ImageGeometry& geometry);

/// `count` slices spread over the structures' boxes; marked slices are preferred if they are near enough.
[[nodiscard]] std::vector<int> spread_slices(int axis, int count, const std::vector<WorldBox>& boxes,
                                             const MarkedSlices& marked, const ImageGeometry& geometry);

/// The slice that cuts the largest number of structures, and of several the one closest to their middle; a marked slice
/// if there are any within the structures.
[[nodiscard]] int middle_slice(int axis, const std::vector<WorldBox>& boxes, const MarkedSlices& marked,
                               const ImageGeometry& geometry);

/// How slices are drawn.
struct SliceStyle {
    double pixel = 1;                    ///< size of a pixel, world units
    double text = 16;                    ///< size of the font, pixels
    Color beyond{0, 0, 0};               ///< colour beyond the image's end
    std::array<double, 2> window{0, 1};  ///< values shown as black and white
    std::vector<Plane> others;           ///< planes whose intersections with this one are drawn
    double mark_radius = 3;              ///< pixels
};

/// Draws the plane's part that lies in the region: the image, the outlines, the marks that are at most half a voxel
/// from the plane along its axis, the plane's name, and letters of the directions at its edges if the axes are
/// anatomical.
void draw_slice(Canvas& canvas, const Rect& at, const Plane& plane, const Region& region, const RenderScene& scene,
                const SliceStyle& style, const RunContext& run);

/// The position on the picture of a point in the plane, pixels.
[[nodiscard]] std::array<double, 2> place_on(const Rect& at, const Plane& plane, const Region& region, double pixel,
                                             const Vec3& index, const ImageGeometry& geometry);

/// The letters of the directions to which and from which an axis of the image points, "L" and "R" for example. Only for
/// anatomical axes.
[[nodiscard]] std::array<std::string, 2> letters_of(int axis, const ImageGeometry& geometry);

/// The plane's name, for example "slice 16, z = 56 µm".
[[nodiscard]] std::string name_of(const Plane& plane, const RenderScene& scene);

}  // namespace covol::figure
