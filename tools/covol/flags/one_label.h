#pragma once
#include "covol/image.h"

namespace covol::tool {

/// 1 where the image has that label, else 0.
[[nodiscard]] Image only(const Image& labels, int label);

}  // namespace covol::tool
