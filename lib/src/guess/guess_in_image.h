#pragma once
#include <vector>

#include "covol/clip.h"
#include "covol/guess.h"

namespace covol::guess {

/// Same as guess_from_marks(), for an image whose axes may be rotated with respect to the world's.
/// @param image  half-spaces that cut the body, used instead of GuessOptions::end; empty: no cut
[[nodiscard]] Guess guess_in_image(const Domain& domain, const std::vector<Vec3>& marks, const GuessOptions& options,
                                   const Clip& image, const RunContext& run);

}  // namespace covol::guess
