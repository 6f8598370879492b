#pragma once

namespace covol::detail {

/// Of the 512 values of a leaf after a step and before it.
struct Change {
    float largest;  ///< max |now - before|; of what is not a number, unsaid
    bool finite;    ///< all values now
};
[[nodiscard]] Change change_of(const float* now, const float* before);

/// Of the 512 values of a leaf.
[[nodiscard]] bool all_finite(const float* values);

}  // namespace covol::detail
