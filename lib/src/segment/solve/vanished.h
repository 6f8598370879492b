#pragma once
#include <string>
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// Explains why a surface that started from tagged points alone vanished, with a remedy: one line for the user.
/// @param tag_distance  D, world units
/// @param encloses  whether the points enclose something at D
[[nodiscard]] std::string why_nothing_held(const std::vector<Vec3>& points, double tag_distance, bool encloses);

}  // namespace covol::detail
