#pragma once
#include <string>
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// Writes the grids to `file` in NanoVDB's format.
/// @param shown  the name of the file in messages
/// @throws Error Unsupported (built without NanoVDB's headers), Io; NanoVDB's own exceptions.
void write_nanovdb(const std::string& file, const std::string& shown, const std::vector<FloatGridPtr>& grids);

}  // namespace covol::detail
