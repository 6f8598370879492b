#pragma once
// Slices of the image: which ones, and how they look.
#include <array>
#include <string>
#include <vector>

#include "covol/render.h"
#include "render/draw/canvas.h"

namespace covol::figure {

/// A plane across one of the image's axes, as it lies on the picture.
struct Plane {
    int axis = 2;                                     ///< it is perpendicular to it
    double index = 0;                                 ///< along that axis
    int across = 0, down = 1;                         ///< axes of the image that go to the right and down
    bool mirror_across = false, mirror_down = false;  ///< the index grows to the left, upwards

    friend bool operator==(const Plane&, const Plane&) = default;
};

/// The part of the image that slices show, from edge to edge of its voxels; indices.
struct Region {
    Vec3 min{0, 0, 0}, max{0, 0, 0};
    /// Along an axis, world units.
    [[nodiscard]] double length(int axis, const ImageGeometry& geometry) const {
        return (max[axis] - min[axis]) * geometry.spacing[axis];
    }
};

/// The structures and a margin around them, as far as the image or they reach.
[[nodiscard]] Region region_around(const std::vector<WorldBox>& boxes, const ImageGeometry& geometry, double margin);

/// The plane across an axis, laid as radiologists do where the axes are anatomical, else as the image's axes lie.
[[nodiscard]] Plane plane_across(int axis, double index, const RenderScene& scene);

/// Slices that people marked: of the axis that the marks lie on whole indices of, few ones; -1 and none elsewhere.
struct MarkedSlices {
    int axis = -1;
    std::vector<int> slices;  ///< sorted
};
[[nodiscard]] MarkedSlices find_marked_slices(const std::vector<Vec3>& marks, const ImageGeometry& geometry);

/// `count` slices spread over the structures' boxes; each is the closest marked one where that is near enough.
[[nodiscard]] std::vector<int> spread_slices(int axis, int count, const std::vector<WorldBox>& boxes,
                                             const MarkedSlices& marked, const ImageGeometry& geometry);

/// The index along an axis that most structures have, closest to their middle; on a marked slice where the axis has
/// some in the structures.
[[nodiscard]] int middle_slice(int axis, const std::vector<WorldBox>& boxes, const MarkedSlices& marked,
                               const ImageGeometry& geometry);

/// How slices are drawn.
struct SliceStyle {
    double pixel = 1;                    ///< world units
    double text = 16;                    ///< size of the font, pixels
    Color beyond{0, 0, 0};               ///< where the image has ended
    std::array<double, 2> window{0, 1};  ///< values shown as black and white
    std::vector<Plane> others;           ///< planes that cut this one: lines show where
    double mark_radius = 3;              ///< pixels
};

/// The plane's part that lies in the region: the image, the outlines, the marks within half a slice, its name, and
/// letters at its edges where the axes are anatomical.
void draw_slice(Canvas& canvas, const Rect& at, const Plane& plane, const Region& region, const RenderScene& scene,
                const SliceStyle& style, const RunContext& run);

/// Where on the picture a place of the plane lies, pixels.
[[nodiscard]] std::array<double, 2> place_on(const Rect& at, const Plane& plane, const Region& region, double pixel,
                                             const Vec3& index, const ImageGeometry& geometry);

/// What the axis of the image points to, and what it comes from: "L" and "R", say. Of anatomical axes.
[[nodiscard]] std::array<std::string, 2> letters_of(int axis, const ImageGeometry& geometry);

/// "slice 16, z = 56 µm"
[[nodiscard]] std::string name_of(const Plane& plane, const RenderScene& scene);

}  // namespace covol::figure
