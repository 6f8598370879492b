#pragma once
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "cli/session.h"
#include "covol/cloud_cleanup.h"
#include "flags/given.h"
#include "flags/input_options.h"

namespace covol::tool {

/// What is done to a cloud before it is used.
struct CloudFlags : Given<CloudCleanupOptions> {
    std::string outlier_factor;  ///< a number; empty: outliers stay
    Given<InputOptions> inputs;

    /// @param with_inputs  --most-points, too
    void bind(CLI::App& command, bool with_inputs);
    /// @throws Error InvalidOptions for what is wrong whatever h is.
    void check() const;
    /// @throws UsageError where an option is given, and there is no cloud.
    void check_used(bool has_cloud) const;
    [[nodiscard]] CloudCleanupOptions cleanup(double h) const;
};

[[nodiscard]] Json to_json(const CloudCleanupReport& report);

}  // namespace covol::tool
