#pragma once
#include <cstddef>
#include <mutex>
#include <optional>

namespace covol::detail {

/// Holds one Switch, which sets something process-wide of another library and sets it back in its destructor, while any
/// of these lives: calls from several threads that overlap leave it as the first of them found it.
/// As visible as its Switch, so that shared libraries may count together.
template <typename Switch>
class __attribute__((visibility("default"))) WhileAny {
public:
    WhileAny() {
        const std::lock_guard<std::mutex> lock(state().mutex);
        if (state().count++ == 0) state().held.emplace();
    }
    ~WhileAny() {
        const std::lock_guard<std::mutex> lock(state().mutex);
        if (--state().count == 0) state().held.reset();
    }
    WhileAny(const WhileAny&) = delete;
    WhileAny& operator=(const WhileAny&) = delete;

private:
    struct State {
        std::mutex mutex;
        std::size_t count = 0;
        std::optional<Switch> held;
    };
    static State& state() {
        static State instance;
        return instance;
    }
};

}  // namespace covol::detail
