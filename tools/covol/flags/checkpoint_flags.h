#pragma once
#include <string>

#include "cli/session.h"

namespace covol::tool {

/// --checkpoint, --checkpoint-every and --resume.
struct CheckpointFlags {
    std::string folder, resumed;
    double every = 600;  ///< seconds

    void bind(CLI::App& command);
    [[nodiscard]] bool given() const { return !folder.empty() || !resumed.empty(); }
    /// After this call, the runs of the session save their states. @throws UsageError; errors of Checkpoints().
    void begin(Session& session) const;
};

}  // namespace covol::tool
