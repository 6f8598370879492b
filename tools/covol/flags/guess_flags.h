#pragma once
#include <string>
#include <vector>

#include "covol/guess_correction.h"
#include "flags/bindings.h"
#include "flags/input_options.h"

namespace covol::tool {

/// --guess and related options: a mask, mesh or level set to be corrected by marks.
struct GuessFlags {
    std::vector<std::string> paths;  ///< each as FILE, or NAME=FILE for one structure
    Given<InputOptions> inputs;

    void bind(CLI::App& command);
};

[[nodiscard]] Json to_json(const CorrectionReport& report);

}  // namespace covol::tool
