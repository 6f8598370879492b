#pragma once
#include <atomic>

// Ctrl-C and other requests to end the program.
namespace covol::tool {

/// Set by signals that request termination, and by the memory guard. RunContext::cancel points to it.
[[nodiscard]] std::atomic<bool>& cancel_flag();
/// Whether a signal requested termination.
[[nodiscard]] bool is_interrupted();
/// Clears cancel_flag() if a signal requested termination, so that the run then ends without an error. For commands
/// such as `mark`, which run until Ctrl-C.
void accept_interrupt();

/// The first signal sets the flag, the second ends the program at once.
void catch_cancel_signals();
/// Handles the signals for a file that is truncated while it is read, and for a file that exceeds the size limit.
void catch_file_signals();

}  // namespace covol::tool
