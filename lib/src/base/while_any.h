#pragma once
#include <cstddef>
#include <mutex>
#include <optional>

namespace covol::detail {

/// Holds one Switch while at least one object of this class exists. A Switch changes a global setting of another
/// library, and restores it in its destructor. Calls of several threads may overlap; once all of them have ended, the
/// setting is the same as before.
/// The class is visible outside a shared library if its Switch is, so that several libraries use the same count.
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
