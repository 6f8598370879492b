#pragma once

namespace covol::detail {

/// Wendland's function in three dimensions that is twice differentiable (Adv. Comput. Math. 4, 1995), of the distance
/// over its support: 1 at 0, and 0 from 1 on.
inline double wendland(double t) {
    if (t >= 1) return 0;
    const double s = (1 - t) * (1 - t);
    return s * s * (4 * t + 1);
}

}  // namespace covol::detail
