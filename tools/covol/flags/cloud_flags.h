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

    /// @param with_most  --most-points, too
    void bind(CLI::App& command, bool with_most);
    /// @throws Error InvalidOptions for what is wrong whatever h is.
    void check() const;
    /// @throws UsageError where an option is given, and there is no cloud.
    void check_used(bool has_cloud) const;
    /// Which points of a cloud without an image are used, sorted in space; says so where these are not all of them, and
    /// puts it into `report` as "thinned_to".
    [[nodiscard]] std::vector<std::uint32_t> used(const std::vector<Vec3>& points, const RunContext& run,
                                                  Json& report) const;
    /// The cloud as asked for; says what was done, and puts it into `report` as "cleanup".
    [[nodiscard]] std::vector<Vec3> clean(const std::vector<Vec3>& points, double h, const RunContext& run,
                                          Json& report) const;

private:
    [[nodiscard]] CloudCleanupOptions cleanup(double h) const;
};

}  // namespace covol::tool
