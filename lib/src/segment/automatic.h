#pragma once
// Before the first step: is the input of use, and which values were left to us?
#include "segment/job.h"

namespace covol::pipeline {

// of a guess, or of a start that they correct: more take long, and are dense
inline constexpr std::size_t kMostGuessMarks = 4000;

/// The automatic range of the points after tagging with an image: what is farther from marks is the image's.
/// Measured on brain, spleen and nucleus with 300 points each; see the README's table.
inline constexpr double kTagAttractionVoxels = 8.0;

/// What there is decides which terms of Eq. (3) can act.
/// @throws Error InvalidOptions, InvalidInput.
void check_input(Job& job);

/// The voxel size, the points at that size, and the lengths and weights that follow from it.
void choose_values(Job& job);

}  // namespace covol::pipeline
