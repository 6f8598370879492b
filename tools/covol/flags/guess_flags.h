#pragma once
#include <string>
#include <vector>

#include "covol/guess_correction.h"
#include "flags/bindings.h"
#include "flags/input_options.h"

namespace covol::tool {

/// Another tool's result to be corrected by marks: --guess and related options.
struct GuessFlags {
    std::vector<std::string> paths;  ///< with NAME= for one structure
    Given<InputOptions> inputs;

    void bind(CLI::App& command);
};

[[nodiscard]] Json to_json(const CorrectionReport& report);

}  // namespace covol::tool
