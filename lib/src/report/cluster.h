#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "covol/mesh.h"

namespace covol::detail {

/// A mesh to look at, with values at its vertices.
struct PageMesh {
    TriangleMesh mesh;
    std::vector<std::pair<std::string, std::vector<float>>> values;  ///< name, one for each vertex
};

/// Draws the vertices of each cell of a lattice together into one of them, the nearest to their mean, until no more
/// than `most` triangles are left: Rossignac and Borrel, Multi-resolution 3D approximations for rendering (1993). Every
/// vertex that is left lies where it lay; values are the cells' means. Time grows with the mesh alone; where a part is
/// thinner than a cell the result need not be manifold.
/// @pre most > 0; values as many as vertices
[[nodiscard]] PageMesh cluster(PageMesh mesh, std::int64_t maximum);

}  // namespace covol::detail
