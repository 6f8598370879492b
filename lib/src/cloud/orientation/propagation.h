#pragma once
// Normals by the planes of neighbourhoods, and their signs from neighbour to neighbour.
#include <vector>

#include "covol/orientation.h"

namespace covol::cloud {

/// Unit normals of the planes through each point's neighbours, of either sign; so many neighbours that noise is
/// averaged.
[[nodiscard]] std::vector<Vec3> plane_normals(const std::vector<Vec3>& points, const CloudScale& scale);

/// plane_normals() with signs that agree along a minimum spanning tree of the graph of neighbours (Hoppe et al.,
/// Surface reconstruction from unorganized points, SIGGRAPH 1992). An edge costs the more, the less parallel its
/// normals are and the farther it leads out of their planes, so that it hardly crosses a thin part. Each connected part
/// of the graph encloses a positive volume with its centre of mass, or is turned towards where most of it is seen from.
/// @param spacing  of these points; `scale` may be that of more of them, world units
/// @param towards  from each point to where it is seen from, 0 if that is not known; empty: not known
[[nodiscard]] std::vector<Vec3> propagated_normals(const std::vector<Vec3>& points, CloudScale scale, double spacing,
                                                   const std::vector<Vec3>& towards = {});

}  // namespace covol::cloud
