#pragma once
// Additional points for tagging. They close bodies that the image cuts off; otherwise the flood fill would enter them
// through the cut.
#include <vector>

#include "covol/clip.h"

namespace covol::detail {

/// A face of the image's box, with the distance between the slices parallel to it.
struct ImageFace {
    HalfSpace plane;
    double spacing = 1;
    /// Distance of a position from the face, world units; positive inside the image.
    [[nodiscard]] double depth(const Vec3& x) const;
};
[[nodiscard]] std::vector<ImageFace> faces_of(const ImageGeometry& geometry);

/// Whether a position is on the last slice in front of a face: inside the image, and not farther from the face than the
/// distance between slices.
[[nodiscard]] bool on_end_slice(const ImageFace& face, const Vec3& x);

/// Copies of the points on each end slice, shifted beyond the face in steps of the slice distance up to `length`. They
/// continue the section of the body, and copies of marks inside the section close it. Only the section is closed, so
/// that the flood fill still reaches the space between the face and a surface that leaves the image at a shallow angle;
/// this space is outside.
[[nodiscard]] std::vector<Vec3> carried_on(const std::vector<Vec3>& points, const std::vector<ImageFace>& faces,
                                           double length);

/// The mirror images of the points in each face to which at least one point is closer than `reach`. A body that is open
/// at the face is closed by its own mirror image, and meets the face at a right angle.
[[nodiscard]] std::vector<Vec3> mirrored(const std::vector<Vec3>& points, const std::vector<ImageFace>& faces,
                                         double reach);

}  // namespace covol::detail
