#pragma once
// Cuts a mesh along a line on it.
#include <vector>

#include "covol/mesh.h"

namespace covol::holes {

/// A mesh whose triangles each lie on one side of a cut.
struct CutMesh {
    TriangleMesh mesh;
    std::vector<char> kept;  ///< for each triangle, whether the value on it is above 0
};
/// Cuts along the line at which a value, linear on each triangle, is 0. Vertices close to it are moved onto it along an
/// edge to avoid slivers; the others keep their positions and numbers.
/// @param values  one for each vertex
[[nodiscard]] CutMesh cut_along(const TriangleMesh& mesh, std::vector<float> values);

/// The kept part. A vertex at which two fans of its triangles meet is duplicated.
[[nodiscard]] TriangleMesh kept_part(const CutMesh& cut);

}  // namespace covol::holes
