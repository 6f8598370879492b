#pragma once
#include <atomic>

// Ctrl-C and other requests to end the program.
namespace covol::tool {

/// Set by a signal that requests termination, and by the memory guard: what a RunContext's `cancel` points to.
[[nodiscard]] std::atomic<bool>& cancel_flag();
/// Whether a signal requested termination.
[[nodiscard]] bool is_interrupted();
/// Ctrl-C is the regular end of this command, not an interruption.
void accept_interrupt();

/// The first signal sets the flag, the second ends the program at once.
void catch_cancel_signals();
/// Handles signals of files that are truncated while they are read, or that exceed the limit of a file's size.
void catch_file_signals();

}  // namespace covol::tool
