#pragma once
#include <string>

#include "covol/run.h"

namespace covol::detail {

/// Refuses what is sure to take more than run.memory_budget, before it takes any.
/// @param bytes   that are needed at least
/// @param what    takes them: "a.zarr: the image"
/// @param advice  what to do; options in backticks
/// @throws Error InvalidOptions
void require_memory(double bytes, const std::string& what, const char* advice, const RunContext& run);

}  // namespace covol::detail
