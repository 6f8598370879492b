#pragma once
#include <memory>
#include <string>
#include <vector>

#include "covol/marks.h"
#include "flags/bindings.h"

namespace covol::tool {

/// --painted and related options.
struct PaintedFlags : Given<PaintedOptions> {
    std::vector<std::string> paths;

    void bind(CLI::App& command);
    /// @throws UsageError if a file that is given as NAME=FILE has several labels;
    /// Error as for read_image() and make_painted()
    [[nodiscard]] std::vector<std::shared_ptr<const PaintedImage>> read(const RunContext& run) const;
};

/// The report's entry for one label.
[[nodiscard]] Json to_json(const PaintedLabel& label);

}  // namespace covol::tool
