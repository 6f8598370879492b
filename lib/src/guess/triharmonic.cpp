#include "guess/triharmonic.h"

#include "base/clones.h"

namespace covol::guess {

COVOL_CLONES void triharmonic_sum(const TriharmonicSum& sum, const double* x, const double* y, const double* z,
                                  double* out) {
    double total[kTriharmonicLanes] = {};
    for (std::size_t j = 0; j < sum.count; ++j) {
        const double a = sum.a[j], bx = 3 * sum.bx[j], by = 3 * sum.by[j], bz = 3 * sum.bz[j];
        for (int l = 0; l < kTriharmonicLanes; ++l) {
            const double dx = x[l] - sum.x[j], dy = y[l] - sum.y[j], dz = z[l] - sum.z[j];
            const double r2 = dx * dx + dy * dy + dz * dz;
            total[l] += __builtin_sqrt(r2) * (a * r2 - (bx * dx + by * dy + bz * dz));
        }
    }
    for (int l = 0; l < kTriharmonicLanes; ++l) out[l] = total[l];
}

}  // namespace covol::guess
