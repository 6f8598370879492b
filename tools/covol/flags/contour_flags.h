#pragma once
#include <string>
#include <vector>

#include "covol/contours.h"
#include "flags/bindings.h"

namespace covol::tool {

/// Contours: marks in order, on slices.
struct ContourFlags : Given<ContourOptions> {
    std::vector<std::string> paths;

    /// @param names  whether a file may be given as NAME=FILE, for one of several structures
    void bind(CLI::App& command, bool names);
};

}  // namespace covol::tool
