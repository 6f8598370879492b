#include "evolve/change_kernel.h"

#include <algorithm>
#include <limits>

#include "base/clones.h"

namespace covol::detail {
namespace {

constexpr int kLanes = 8, kValues = 512;  // values computed at a time, values of a leaf

COVOL_INLINE Float8 size_of(const Float8& x) { return x < 0.0F ? -x : x; }

/// False for NaN, too.
COVOL_INLINE Int8 is_finite(const Float8& x) { return size_of(x) <= std::numeric_limits<float>::max(); }

}  // namespace

COVOL_CLONES Change change_of(const float* now, const float* before) {
    Float8 largest{};
    Int8 beyond{};
    for (int n = 0; n < kValues; n += kLanes) {
        const Float8 value = load<Float8>(now + n), size = size_of(value - load<Float8>(before + n));
        largest = largest < size ? size : largest;
        beyond |= ~is_finite(value);
    }
    Change change{0.0F, !any(beyond)};
    for (int l = 0; l < kLanes; ++l) change.largest = std::max(change.largest, largest[l]);
    return change;
}

COVOL_CLONES bool all_finite(const float* values) {
    Int8 beyond{};
    for (int n = 0; n < kValues; n += kLanes) beyond |= ~is_finite(load<Float8>(values + n));
    return !any(beyond);
}

}  // namespace covol::detail
