#pragma once
#include <vector>

#include "covol/clip.h"
#include "covol/guess.h"

namespace covol::guess {

/// guess_from_marks() in an image whose axes may differ from the world's.
/// @param image  cuts the body, instead of GuessOptions::end; empty: no cut
[[nodiscard]] Guess guess_in_image(const Domain& domain, const std::vector<Vec3>& marks, const GuessOptions& options,
                                   const Clip& image, const RunContext& run);

}  // namespace covol::guess
