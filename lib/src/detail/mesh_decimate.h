#pragma once
#include <cstddef>

#include "covol/mesh.h"

namespace covol::detail {

/// Collapses edges until about `triangles` are left, those first that move the surface least (quadric error metric,
/// Garland and Heckbert 1997). Collapses that would flip a triangle or leave the mesh not manifold are not done.
/// @pre  a manifold mesh. @throws Error InvalidInput when it is not.
void decimate(TriangleMesh& mesh, std::size_t triangles);

}  // namespace covol::detail
