#pragma once
#include "covol/mesh.h"

namespace covol::detail {

/// The result of closing a mesh.
struct ClosedMesh {
    TriangleMesh mesh;        ///< each edge occurs equally often in both directions, so that there is an inside
    int holes = 0;            ///< number of holes that were closed
    double cap_fraction = 0;  ///< area of the caps / area of the mesh
};

/// Closes each hole by triangles between its rim and the rim's centre.
[[nodiscard]] ClosedMesh close_holes(const TriangleMesh& mesh);

}  // namespace covol::detail
