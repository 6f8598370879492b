#pragma once
// What a process has from who started it.
#include <string>

namespace covol::tool {

/// Of standard streams that are closed a file would take the place, and get what is said there.
void keep_standard_streams();

/// Takes as many file handles as it may and a stack of images needs. @return what to say where those are too few
[[nodiscard]] std::string too_few_files();

/// Of the signals that ask a program to end. Not before there is something to end well: until then one ends the program
/// at once, also where it waits for a configuration that comes through a pipe.
void catch_signals(void (*handler)(int));

}  // namespace covol::tool
