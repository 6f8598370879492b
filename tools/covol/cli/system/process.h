#pragma once
// Resources that a process inherits from its parent.
#include <string>

namespace covol::tool {

/// If a standard stream is closed, a file would get its number, and receive the program's messages.
void keep_standard_streams();

/// Raises the limit of open files as far as allowed, for image stacks. @return a message if the limit is too low
[[nodiscard]] std::string too_few_files();

/// Handles the signals that request termination. Not called before there is work to end in an orderly way: until then a
/// signal ends the program at once, even while it waits for a configuration from a pipe.
void catch_signals(void (*handler)(int));

}  // namespace covol::tool
