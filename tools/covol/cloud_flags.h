#pragma once
#include <string>
#include <vector>

#include "arguments.h"
#include "covol/cloud_cleanup.h"
#include "session.h"

namespace covol::tool {

/// What is done to a cloud before it is used.
struct CloudFlags {
    std::string outlier_factor;  ///< a number; empty: outliers stay
    Length simplify;
    CloudSmoothing smooth = CloudSmoothing::None;

    void bind(CLI::App& command);
    /// @throws Error InvalidOptions for what is wrong whatever h is.
    void check() const;
    /// The cloud as asked for; says what was done, and puts it into `report` as "cleanup".
    [[nodiscard]] std::vector<Vec3> clean(const std::vector<Vec3>& points, double h, const RunContext& run, Json& report) const;

private:
    [[nodiscard]] CloudCleanupOptions resolve(double h) const;
};

}  // namespace covol::tool
