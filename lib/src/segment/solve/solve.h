#pragma once
// From a start to the surface that is kept: what is lost on the way is replaced by what the start or the marks tell.
#include "segment/solve/flow.h"

namespace covol::pipeline {

/// The flow from `start`, after the coarse levels that are asked for. A surface that vanished, or that left the marks,
/// is not returned while the start or the marks tell of one.
/// @param edge     with the feature that the marks lie on
/// @param reached  kept up to date, or null
/// @throws Error InvalidInput (the surface vanished); as the single steps.
[[nodiscard]] Solution solve(const Problem& problem, const Choices& choices, StartSurface start,
                             const EdgeOptions& edge, Reached* reached);

}  // namespace covol::pipeline
