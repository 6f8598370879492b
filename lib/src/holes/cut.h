#pragma once
// A mesh cut along a line on it.
#include <vector>

#include "covol/mesh.h"

namespace covol::holes {

/// Triangles on one side each.
struct CutMesh {
    TriangleMesh mesh;
    std::vector<char> kept;  ///< of each triangle: where the value is above 0
};
/// Along the line where a value, linear on each triangle, is 0. Vertices close to it are moved onto it along an edge,
/// so that it leaves no slivers; the others stay, with their numbers.
/// @param values  one for each vertex
[[nodiscard]] CutMesh cut_along(const TriangleMesh& mesh, std::vector<float> values);

/// The kept part. A vertex at which two of its fans meet becomes two.
[[nodiscard]] TriangleMesh kept_part(const CutMesh& cut);

}  // namespace covol::holes
