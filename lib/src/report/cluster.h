#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "covol/mesh.h"

namespace covol::detail {

/// A mesh for display, with values at its vertices.
struct PageMesh {
    TriangleMesh mesh;
    std::vector<std::pair<std::string, std::vector<float>>> values;  ///< name, and one value for each vertex
};

/// Vertex clustering: merges the vertices of each cell of a lattice into one of them, the nearest to their mean, with
/// cells that grow until at most `maximum` triangles remain: Rossignac and Borrel, Multi-resolution 3D approximations
/// for rendering (1993). Remaining vertices keep their positions; values are the cells' means. The time depends only on
/// the size of the mesh; where a part is thinner than a cell, the result need not be manifold.
/// @pre maximum > 0; as many values as vertices
[[nodiscard]] PageMesh cluster(PageMesh mesh, std::int64_t maximum);

}  // namespace covol::detail
