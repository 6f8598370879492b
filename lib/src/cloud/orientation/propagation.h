#pragma once
// Normals from planes through neighbourhoods, with signs propagated from neighbour to neighbour.
#include <vector>

#include "covol/orientation.h"

namespace covol::cloud {

/// Unit normals of the planes through each point's neighbours, of either sign, with enough neighbours to average the
/// noise.
[[nodiscard]] std::vector<Vec3> plane_normals(const std::vector<Vec3>& points, const CloudScale& scale);

/// plane_normals() with signs that agree along a minimum spanning tree of the graph of neighbours (Hoppe et al.,
/// Surface reconstruction from unorganized points, SIGGRAPH 1992). The cost of an edge increases with the angle between
/// its normals and with its angle to their planes, so that edges across thin parts are avoided. Each connected part of
/// the graph is oriented such that it encloses a positive volume with its centre of mass or, if `towards` is given,
/// faces the side from which most of it is seen.
/// @param spacing  of these points, world units; `scale` may be that of a larger set
/// @param towards  direction from each point to its viewpoint, 0 if unknown; empty: all unknown
[[nodiscard]] std::vector<Vec3> propagated_normals(const std::vector<Vec3>& points, CloudScale scale, double spacing,
                                                   const std::vector<Vec3>& towards = {});

}  // namespace covol::cloud
