#pragma once
#include <memory>
#include <string>
#include <vector>

#include "bindings.h"
#include "covol/contours.h"
#include "session.h"

namespace covol::tool {

/// Ordered marks on slices.
struct ContourFlags {
    std::vector<std::string> paths;
    ContourCurve curve = ContourCurve::Lines;

    void bind(CLI::App& command);
    /// @param reading  how coordinates are understood, as for points
    [[nodiscard]] std::vector<PointCloud> read(const ReadPointsOptions& reading, const ImageGeometry* geometry,
                                               const RunContext& run) const;
    /// Null without a file. Fills input.contours of the report.
    [[nodiscard]] std::shared_ptr<const Contours> densify(const std::vector<PointCloud>& clouds, const ImageGeometry* geometry,
                                                          double h, Session& session) const;
};

}  // namespace covol::tool
