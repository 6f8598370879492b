#pragma once
#include <string>
#include <vector>

#include "cli/options/arguments.h"
#include "cli/session.h"
#include "covol/cloud_cleanup.h"
#include "flags/given.h"
#include "flags/input_options.h"

namespace covol::tool {

/// Cleaning of a cloud before it is used.
struct CloudFlags : Given<CloudCleanupOptions> {
    std::string outlier_factor;  ///< text of the option, a number; empty: outliers are kept
    Given<InputOptions> inputs;

    /// @param with_inputs  whether to add --most-points
    void bind(CLI::App& command, bool with_inputs);
    /// @throws Error InvalidOptions for values that are invalid for every voxel size.
    void check() const;
    /// @throws UsageError if an option is given, but there is no cloud.
    void check_used(bool has_cloud) const;
    [[nodiscard]] CloudCleanupOptions cleanup(double h) const;
};

[[nodiscard]] Json to_json(const CloudCleanupReport& report);

}  // namespace covol::tool
