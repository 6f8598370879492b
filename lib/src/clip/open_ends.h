#pragma once
// Additional points for tagging, which close bodies that the image cuts off: the flood fill comes from all sides.
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

/// Whether a position is on the last slice at a face: inside, and not deeper than the distance between slices.
[[nodiscard]] bool on_end_slice(const ImageFace& face, const Vec3& x);

/// Copies of the points on each end slice, shifted beyond the face in steps of the slice distance up to `length`. They
/// continue the section, and copies of marks inside the section close it beyond the face. The flood fill can therefore
/// pass above a surface that leaves the image at a shallow angle, between it and the face.
[[nodiscard]] std::vector<Vec3> carried_on(const std::vector<Vec3>& points, const std::vector<ImageFace>& faces,
                                           double length);

/// The points' mirror images in each face that some points are nearer to than `reach`: an open body is closed by its
/// own mirror image, and meets the face at a right angle.
[[nodiscard]] std::vector<Vec3> mirrored(const std::vector<Vec3>& points, const std::vector<ImageFace>& faces,
                                         double reach);

}  // namespace covol::detail
