#pragma once
// Resources that a process inherits from its parent.
#include <string>

namespace covol::tool {

/// Opens /dev/null for each standard stream that is closed. Otherwise the next file that is opened would get the number
/// of the stream, and receive the program's messages.
void keep_standard_streams();

/// Raises the limit of open files to 4096, or as far as allowed, because image stacks consist of many files.
/// @return an error message if fewer than 16 files are allowed, otherwise an empty text
[[nodiscard]] std::string too_few_files();

/// Installs a handler for the signals that request termination. Should not be called before the run starts: until then,
/// a signal ends the program at once, even while it waits for a configuration from a pipe.
void catch_signals(void (*handler)(int));

}  // namespace covol::tool
