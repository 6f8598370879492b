#pragma once
#include <string>
#include <vector>

#include "covol/guess_correction.h"
#include "flags/bindings.h"
#include "flags/input_options.h"

namespace covol::tool {

/// Another tool's result that marks correct: --guess and what belongs to it.
struct GuessFlags {
    std::vector<std::string> paths;  ///< with NAME= of one structure
    Given<InputOptions> inputs;

    void bind(CLI::App& command);
};

[[nodiscard]] Json to_json(const CorrectionReport& report);

}  // namespace covol::tool
