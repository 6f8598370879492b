#pragma once
#include <memory>
#include <string>
#include <vector>

#include "covol/contours.h"
#include "flags/bindings.h"
#include "flags/cloud_flags.h"
#include "flags/contour_flags.h"

namespace covol::tool {

/// The marks of one structure: what its files hold, and what segment() takes once h is known.
struct Marks {
    std::vector<Vec3> given;        ///< all of them as they were clicked, world units; cleaned by prepare_marks()
    std::vector<Vec3> points;       ///< those that are no contours
    PointHints hints;               ///< of those
    std::vector<PointCloud> drawn;  ///< contours
    std::shared_ptr<const Contours> contours;  ///< null before densify(), and without a file
    Json report;                               ///< {"points": {...}, "contours": {...}}
};

/// Reads both kinds of files. With an image, marks outside it are an error; without one, points are sorted in space and
/// thinned.
[[nodiscard]] Marks read_marks(const PointFlags& points, const ContourFlags& contours, const CloudFlags& cloud,
                               const ImageGeometry* geometry, const RunContext& run);

/// Cleans the points, and densifies the contours with step h.
void prepare_marks(Marks& marks, const CloudFlags& cloud, const ContourFlags& contours, const ImageGeometry* geometry,
                   double h, Session& session, const RunContext& run);

}  // namespace covol::tool
