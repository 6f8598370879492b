#pragma once

namespace covol::detail {

/// The change of the 512 values of a leaf by a step.
struct Change {
    float largest;  ///< max |now - before|; unspecified for NaN
    bool finite;    ///< whether all values of `now` are
};
[[nodiscard]] Change change_of(const float* now, const float* before);

/// Whether the 512 values of a leaf are finite.
[[nodiscard]] bool all_finite(const float* values);

}  // namespace covol::detail
