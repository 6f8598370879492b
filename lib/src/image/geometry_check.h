#pragma once
#include <string>

#include "covol/image.h"

namespace covol::detail {

/// @throws Error InvalidInput, Unsupported unless floating-point numbers represent the lattice accurately, and its axes
/// are linearly independent.
void check_geometry(const std::string& where, const ImageGeometry& g);

}  // namespace covol::detail
