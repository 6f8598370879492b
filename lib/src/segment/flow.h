#pragma once
#include "segment/job.h"

namespace covol::pipeline {

/// Moves job.result.u until nothing moves, in the fields of the job.
void flow(Job& job);

[[nodiscard]] bool has_vanished(const Job& job);

/// Whether the flow lost a start that was good by itself.
[[nodiscard]] bool has_lost(const Job& job, const FloatGrid& start);

/// @throws Error InvalidInput (the surface vanished).
void check_flow(Job& job);

}  // namespace covol::pipeline
