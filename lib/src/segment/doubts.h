#pragma once
// What speaks against a start or a result.
#include <string>
#include <vector>

#include "segment/start/start_surface.h"

namespace covol::pipeline {

/// Where a mark lies, in words: on a slice, at a voxel of the image, or in the world. @param image  null: there is none
[[nodiscard]] std::string place_of(const Image* image, const Vec3& mark);

/// Warns of marks that lie where no others are, before anything is made of them.
[[nodiscard]] Remarks doubt_isolated_marks(const Problem& problem);

/// Which of some places all over the image's border lie inside `u`; empty where there is no image.
[[nodiscard]] std::vector<char> inside_on_border(const Problem& problem, const FloatGrid& u);

/// Of a surface that came out inside out: most of the image's border is inside, and neither marks, nor seeds, nor a
/// start that was named, say so.
/// @param in_start  inside_on_border() of the start that was named, or empty
/// @throws Error InvalidInput
void require_outside(const Problem& problem, const FloatGrid& u, const std::vector<char>& in_start);

/// How far a mark may lie from the surface that it marks, world units.
/// @param noise  of a cloud, else 0
[[nodiscard]] double largest_error_of_marks(const Problem& problem, double h, double noise);

/// Whether so many trusted marks lie off the zero level set of `u` that it cannot be what they mark.
[[nodiscard]] bool misses_marks(const Problem& problem, const StartFacts& start, const FloatGrid& u);

}  // namespace covol::pipeline
