#pragma once

namespace covol::detail {

/// Wendland's compactly supported radial function of smoothness C2 in three dimensions (Adv. Comput. Math. 4, 1995): 1
/// at t = 0, decreasing to 0 at t = 1.
/// @param t  distance, divided by the radius of the support
inline double wendland(double t) {
    if (t >= 1) return 0;
    const double s = (1 - t) * (1 - t);
    return s * s * (4 * t + 1);
}

}  // namespace covol::detail
