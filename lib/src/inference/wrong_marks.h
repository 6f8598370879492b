#pragma once
#include <vector>

namespace covol::inference {

/// The posterior probability of each mark that it is wrong. Right marks lie about as far from the body as it is
/// uncertain, wrong ones anywhere: a mixture of two exponential distributions, fitted by expectation maximisation
/// (Dempster, Laird and Rubin, J. R. Stat. Soc. B 39(1), 1977). Right marks at a part that the body lacks also appear
/// wrong.
///
/// @param off       distances of the marks to a body
/// @param anywhere  mean distance of all positions to it
/// @param smallest  lower bound of the estimated mean distance of right marks; the same unit
[[nodiscard]] std::vector<double> probability_wrong(const std::vector<double>& off, double anywhere, double smallest);

}  // namespace covol::inference
