#pragma once
#include <algorithm>
#include <chrono>

namespace covol::serve {

/// Limits the messages of a client: at most `burst` at once, and at most `per_second` per second on average.
class MessageRate {
public:
    using Time = std::chrono::steady_clock::time_point;

    /// @param per_second  > 0 @param burst  >= 1
    MessageRate(double per_second, double burst) : per_second_(per_second), burst_(burst), left_(burst) {}

    /// Counts a message. @return false if it exceeds the limit
    [[nodiscard]] bool allows_one(Time now) {
        left_ = std::min(burst_, left_ + per_second_ * std::chrono::duration<double>(now - counted_).count());
        counted_ = now;
        if (left_ < 1) return false;
        left_ -= 1;
        return true;
    }

private:
    double per_second_, burst_, left_;
    Time counted_{};
};

}  // namespace covol::serve
