#pragma once
// Before the first step: is the input of use, and which values were left to us?
#include "segment/job.h"

namespace covol::pipeline {

/// What there is decides which terms of Eq. (3) can act.
/// @throws Error InvalidOptions, InvalidInput.
void check_input(Job& job);

/// The voxel size, the points at that size, and the lengths and weights that follow from it.
void choose_values(Job& job);

}  // namespace covol::pipeline
