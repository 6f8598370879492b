#pragma once
#include <string>
#include <vector>

#include "cli/session.h"

// The page of `covol mark`, for use by another command.
namespace covol::tool {

/// Arguments of `covol mark`.
struct MarkCall {
    std::string image;                ///< the study is beside it
    std::vector<std::string> points;  ///< [NAME=]FILE
    bool without_browser = false;
    int port = 0;
};

/// Serves the page until Ctrl-C. @throws Error as `covol mark`
void run_mark(Session& session, const MarkCall& call);

/// --no-browser and --port.
void bind_page(CLI::App& command, bool& without_browser, int& port);

}  // namespace covol::tool
