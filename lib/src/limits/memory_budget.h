#pragma once
#include <string>

#include "covol/run.h"

namespace covol::detail {

/// Throws an error if a computation needs more than run.memory_budget; to be called before it allocates memory.
/// @param bytes   minimum memory that is needed
/// @param what    subject of the message: "a.zarr: the image"
/// @param advice  how the user can reduce the memory; options in backticks
/// @throws Error InvalidOptions
void require_memory(double bytes, const std::string& what, const char* advice, const RunContext& run);

}  // namespace covol::detail
