#pragma once
#include <memory>
#include <string>
#include <vector>

#include "cli/session.h"
#include "covol/contours.h"
#include "flags/bindings.h"

namespace covol::tool {

/// Ordered marks on slices.
struct ContourFlags : Given<ContourOptions> {
    std::vector<std::string> paths;

    /// @param names  files may be NAME=FILE: of one structure among several
    void bind(CLI::App& command, bool names);
    /// @param reading  how coordinates are understood, as for points
    [[nodiscard]] std::vector<PointCloud> read(const ReadPointsOptions& reading, const ImageGeometry* geometry,
                                               const RunContext& run) const;
    /// With step h. Says what came of it, and fills the report's input.contours.
    [[nodiscard]] std::shared_ptr<const Contours> densify(const std::vector<PointCloud>& clouds,
                                                          const ImageGeometry* geometry, double h,
                                                          const RunContext& run, Json& report) const;
};

}  // namespace covol::tool
