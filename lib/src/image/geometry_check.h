#pragma once
#include <string>

#include "covol/image.h"

namespace covol::detail {

/// @throws Error InvalidInput, Unsupported unless numbers hold the lattice well, and its axes are perpendicular.
void check_geometry(const std::string& where, const ImageGeometry& g);

}  // namespace covol::detail
