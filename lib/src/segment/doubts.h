#pragma once
// Checks that raise doubts about a start or a result.
#include <string>
#include <vector>

#include "segment/start/start_surface.h"

namespace covol::pipeline {

/// Describes the position of a mark as text: on a slice, at a voxel of the image, or in the world.
/// @param image  null if there is none
[[nodiscard]] std::string place_of(const Image* image, const Vec3& mark);

/// Warns of marks that lie far from all others, before any processing.
[[nodiscard]] Remarks doubt_isolated_marks(const Problem& problem);

/// For each of a fixed set of positions on the image's border, whether it is inside `u`; empty without an image.
[[nodiscard]] std::vector<char> inside_on_border(const Problem& problem, const FloatGrid& u);

/// Rejects a surface that is inside out: most of the image's border is inside although neither marks, nor seeds, nor a
/// named start imply it.
/// @param in_start  inside_on_border() of the named start, or empty
/// @throws Error InvalidInput
void require_outside(const Problem& problem, const FloatGrid& u, const std::vector<char>& in_start);

/// Distance from all marks beyond which the marks do not support a surface: half of the diagonal of their bounding box.
[[nodiscard]] double far_from_marks(const std::vector<Vec3>& marks);

/// Maximum plausible distance of a mark from the surface that it marks, world units.
/// @param noise  standard deviation of a cloud's noise; 0 for other points
[[nodiscard]] double largest_error_of_marks(const Problem& problem, double h, double noise);

/// Whether so many trusted marks in the domain lie off the zero level set of `u` that it cannot be the marked surface;
/// false if there are none in the domain.
[[nodiscard]] bool misses_marks(const Problem& problem, const StartFacts& start, const FloatGrid& u);

}  // namespace covol::pipeline
