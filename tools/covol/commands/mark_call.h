#pragma once
#include <string>
#include <vector>

#include "cli/session.h"

// The page of `covol mark`, for use by another command.
namespace covol::tool {

/// Arguments of `covol mark`.
struct MarkCall {
    std::string image;                ///< path; the study is in the same folder
    std::vector<std::string> points;  ///< files of marks, each as [NAME=]FILE
    bool without_browser = false;
    int port = 0;
};

/// Runs `covol mark`: serves the page until Ctrl-C. @throws Error
void run_mark(Session& session, const MarkCall& call);

/// Adds --no-browser and --port.
void bind_page(CLI::App& command, bool& without_browser, int& port);

}  // namespace covol::tool
