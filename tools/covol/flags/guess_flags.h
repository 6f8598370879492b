#pragma once
#include <memory>
#include <optional>
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

/// It as segment() takes it, and the mask that is written back.
struct Guess {
    Start start;
    std::optional<Image> mask;  ///< as the file holds it
    int label = 1;              ///< what is inside
};
/// @throws Error InvalidInput (several labels and none chosen: lists them; outside of the image).
[[nodiscard]] Guess read_guess(const std::string& path, int label, const ImageGeometry& image, bool force,
                               const RunContext& run);

[[nodiscard]] Json to_json(const CorrectionReport& report);

}  // namespace covol::tool
