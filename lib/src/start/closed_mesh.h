#pragma once
#include "covol/mesh.h"

namespace covol::detail {

/// What it took to close a mesh.
struct ClosedMesh {
    TriangleMesh mesh;        ///< each edge is passed as often one way as the other: it has an inside
    int holes = 0;            ///< that were closed; 0: it was closed
    double cap_fraction = 0;  ///< area of what closes them / area of the mesh
};

/// Closes each hole by triangles between its rim and the rim's centre.
[[nodiscard]] ClosedMesh close_holes(const TriangleMesh& mesh);

}  // namespace covol::detail
