#pragma once
// The values that are left to us.
#include <optional>
#include <vector>

#include "segment/problem.h"
#include "segment/step.h"

namespace covol::pipeline {

/// How the level set starts: what SegmentOptions::start and the input come to.
enum class StartMethod {
    Corrected,  ///< another tool's result, corrected by marks
    Seeds,      ///< seeds inside are all that is given
    Guess,      ///< the surface through few marks
    Cloud,      ///< the surface behind a cloud
    Tagged,     ///< the points, tagged, or the body between contours
    Named       ///< the sphere, box, mesh, mask or level set of the options
};

[[nodiscard]] inline bool uses_points(const EvolveOptions& flow) { return flow.theta > 0; }
[[nodiscard]] inline bool uses_image(const EvolveOptions& flow) { return flow.rho > 0; }

/// What the problem leaves open, chosen; each step has what it needs of it in world units.
struct Choices {
    double h = 0;  ///< voxel size
    StartMethod start = StartMethod::Tagged;
    EvolveOptions evolve;  ///< of the flow, if the start does not know better; terms that cannot act have the weight 0
    EdgeOptions edge;
    std::optional<CloudOrientation> cloud;  ///< of a cloud
    std::vector<Vec3> measured_marks;       ///< that the fit is measured at
    StepReport report;
};

/// Marks as they were, and marks as they are used: without duplicates, and without the noise of scans.
struct Resolved {
    Choices choices;
    MarkSets marks;
};

/// Chooses the voxel size, the marks at that size, the start, and the lengths and weights that follow from them.
/// @throws Error InvalidInput, InvalidOptions.
[[nodiscard]] Resolved resolve(const Problem& problem);

}  // namespace covol::pipeline
