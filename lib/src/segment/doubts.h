#pragma once
#include <vector>

#include "segment/job.h"

namespace covol::pipeline {

/// What speaks against the result: marks that lie off the surface, or on one side of it, and an image that does not
/// show what they mark. Goes into the report, and to people.
/// @param marks      world units
/// @param distances  of each to the surface
void doubt(Job& job, const std::vector<Vec3>& marks, const std::vector<double>& distances);

/// The same of marks that lie where no others are, before anything is made of them.
void doubt_isolated_marks(Job& job);

/// Notes what of the image's border a start that the caller named holds already: job.border_in_start.
void note_border(Job& job);

/// Of a surface that came out inside out: most of the image's border is inside, and neither marks, nor seeds, nor a
/// start that was named, say so.
/// @throws Error InvalidInput
void require_outside(const Job& job);

/// Of a level set, trilinear. @param places  world units
[[nodiscard]] std::vector<double> levels_at(const FloatGrid& u, const std::vector<Vec3>& places);

/// Whether so many marks lie off the zero level set of `u` that it cannot be what they mark.
[[nodiscard]] bool misses_marks(const Job& job, const FloatGrid& u);

}  // namespace covol::pipeline
