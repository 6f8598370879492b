#pragma once
#include <vector>

#include "covol/mesh.h"
#include "covol/surface.h"

namespace covol::detail {

/// The distance of each point to the triangles of a mesh, not only to its vertices; in parallel.
/// @pre mesh.triangles is not empty
[[nodiscard]] std::vector<double> distances_to(const TriangleMesh& mesh, const std::vector<Vec3>& points);

/// Mean, 95th percentile and maximum of the distances. @pre `distances` is not empty
[[nodiscard]] FitStatistics statistics_of(std::vector<double> distances);

}  // namespace covol::detail
