#pragma once
#include <vector>

namespace covol::inference {

/// The posterior probability of each mark that it is wrong. It is computed from a mixture of two exponential
/// distributions of the distances from the body, which is fitted by expectation maximisation (Dempster, Laird and
/// Rubin, J. R. Stat. Soc. B 39(1), 1977): right marks are about as far from the body as its error, and wrong ones
/// anywhere. Right marks at a part of the structure that the body lacks appear wrong, too.
///
/// @param off       distances of the marks to a body
/// @param anywhere  mean distance of all positions to the body
/// @param smallest  lower bound of the estimated mean distance of right marks; the same unit
[[nodiscard]] std::vector<double> probability_wrong(const std::vector<double>& off, double anywhere, double smallest);

}  // namespace covol::inference
