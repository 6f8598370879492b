#pragma once
#include <string>
#include <vector>

#include "cli/session.h"

// The page of `covol mark`, for another command.
namespace covol::tool {

/// What `covol mark` is called with.
struct MarkCall {
    std::string image;                ///< the study lies beside it
    std::vector<std::string> points;  ///< [NAME=]FILE
    bool without_browser = false;
    int port = 0;
};

/// Serves the page until Ctrl-C. @throws Error as `covol mark`
void run_mark(Session& session, const MarkCall& call);

/// --no-browser and --port.
void bind_page(CLI::App& command, bool& without_browser, int& port);

}  // namespace covol::tool
