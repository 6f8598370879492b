#pragma once
// Automatic choices: the values that the caller leaves open.
#include <optional>
#include <vector>

#include "covol/domain.h"
#include "segment/problem.h"
#include "segment/step.h"

namespace covol::pipeline {

/// [voxels] Automatic attraction range. Points attract fully up to half of this distance, which is the half-width of
/// the narrow band.
inline constexpr double kAttractionVoxels = 2 * kHalfWidthVoxels;

/// How the level set starts, resolved from SegmentOptions::start and the input.
enum class StartMethod {
    Corrected,  ///< another tool's result, corrected by marks
    Seeds,      ///< only seeds inside are given
    Guess,      ///< the surface through few marks
    Cloud,      ///< the surface of a cloud
    Tagged,     ///< tagged points, or the body between contours
    Named       ///< the sphere, box, mesh, mask or level set of the options
};

[[nodiscard]] inline bool uses_points(const EvolveOptions& flow) { return flow.theta > 0; }
[[nodiscard]] inline bool uses_image(const EvolveOptions& flow) { return flow.rho > 0; }

/// The automatic choices for a problem, in world units, as the steps need them.
struct Choices {
    double h = 0;  ///< voxel size
    StartMethod start = StartMethod::Tagged;
    EvolveOptions evolve;  ///< of the flow, unless the start sets its own; terms without an input have weight 0
    EdgeOptions edge;
    std::optional<CloudOrientation> cloud;  ///< only for a cloud
    std::vector<Vec3> measured_marks;       ///< marks at which the fit is measured
    StepReport report;
};

/// The choices, and the marks as used: points that almost coincide are merged, and a thick layer of tagged points
/// without an image is averaged to its middle surface.
struct Resolved {
    Choices choices;
    MarkSets marks;
};

/// Chooses the voxel size, the marks at that size, the start, and the lengths and weights that follow from them.
/// @throws Error InvalidInput, InvalidOptions.
[[nodiscard]] Resolved resolve(const Problem& problem);

}  // namespace covol::pipeline
