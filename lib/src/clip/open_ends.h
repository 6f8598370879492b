#pragma once
// Clouds of bodies that the image cuts off: what closes them for tagging, whose flood comes in from every side.
#include <vector>

#include "covol/clip.h"

namespace covol::detail {

/// A face of the image's box, and how far apart the slices along it are.
struct ImageFace {
    HalfSpace plane;
    double spacing = 1;
    /// Of a position inside, >= 0.
    [[nodiscard]] double depth(const Vec3& x) const;
};
[[nodiscard]] std::vector<ImageFace> faces_of(const ImageGeometry& geometry);

/// Points of the last slice along a face: not deeper than the slices are apart.
[[nodiscard]] bool on_end_slice(const ImageFace& face, const Vec3& x);

/// The section on each end slice goes on beyond the face: its points again and again, up to `length` beyond. Where
/// marks lie within the section, too, they close it there, and the flood passes above a surface that leaves the image
/// slowly.
[[nodiscard]] std::vector<Vec3> carried_on(const std::vector<Vec3>& points, const std::vector<ImageFace>& faces,
                                           double length);

/// The points' mirror images beyond each face that some of them lie nearer to than `reach`: with its own mirror image a
/// body that is open there is closed, and meets the face at a right angle.
[[nodiscard]] std::vector<Vec3> mirrored(const std::vector<Vec3>& points, const std::vector<ImageFace>& faces,
                                         double reach);

}  // namespace covol::detail
