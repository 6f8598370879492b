#include "inference/wrong_marks.h"

#include <algorithm>
#include <cmath>

#include "base/heuristics.h"

namespace covol::inference {

std::vector<double> probability_wrong(const std::vector<double>& off, double anywhere, double smallest) {
    constexpr int kSteps = 50;
    std::vector<double> wrong(off.size(), 0.0);
    double fraction = kCommon.minority, usual = smallest;
    for (int step = 0; step < kSteps; ++step) {
        double sum = 0, off_if_right = 0;
        for (std::size_t n = 0; n < off.size(); ++n) {
            const double if_wrong = fraction * std::exp(-off[n] / anywhere) / anywhere,
                         if_right = (1 - fraction) * std::exp(-off[n] / usual) / usual;
            wrong[n] = if_wrong / (if_wrong + if_right);
            sum += wrong[n];
            off_if_right += (1 - wrong[n]) * off[n];
        }
        usual = std::max(off_if_right / std::max(double(off.size()) - sum, 1.0), smallest);
        fraction = sum / std::max(double(off.size()), 1.0);
    }
    return wrong;
}

}  // namespace covol::inference
