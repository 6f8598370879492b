#pragma once
#include <functional>
#include <optional>
#include <string>

#include "covol/error.h"

namespace covol::detail {

/// How a piece of work ended that was tried in a copy of this process.
struct Trial {
    bool crashed = false;          ///< it ended by a signal, or not within the time
    std::optional<Error> refused;  ///< what it threw; the message cut after some 4,000 characters
};

/// Calls `work` in a copy of this process, which is then given up: what a library that crashes on damaged files would
/// do with one. Only the calling thread goes on in the copy, so `work` must need no other, nor a lock that one may
/// hold. Where the system gives no copy the work counts as done.
[[nodiscard]] Trial try_in_child(const std::function<void()>& work, double seconds);

/// Tries whether `library` can read the image `path`. @throws Error InvalidInput where it crashed, or took a minute,
/// and what `read` threw.
void try_reading(const std::string& path, const char* library, const std::function<void()>& read);

}  // namespace covol::detail
