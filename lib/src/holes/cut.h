#pragma once
// Cuts a mesh along a line on it.
#include <vector>

#include "covol/mesh.h"

namespace covol::holes {

/// A mesh that was cut: each of its triangles lies on one side of the cut.
struct CutMesh {
    TriangleMesh mesh;
    std::vector<char> kept;  ///< for each triangle, whether the value on it is above 0
};
/// Cuts a mesh along the line on which a value, interpolated linearly on each triangle, is 0. Vertices close to the
/// line are moved onto it along an edge, because cutting beside them would create slivers. The other vertices keep
/// their positions and numbers.
/// @param values  one for each vertex
[[nodiscard]] CutMesh cut_along(const TriangleMesh& mesh, std::vector<float> values);

/// The kept part. A vertex at which two fans of its triangles meet is duplicated.
[[nodiscard]] TriangleMesh kept_part(const CutMesh& cut);

}  // namespace covol::holes
