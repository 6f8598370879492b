#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "covol/mesh.h"

// Meshes in few bytes. Browsers undo this in tools/viewer/src/data.js.
namespace covol::detail {

/// Vertices on a lattice of 65536 steps along each side of their box; what no triangle uses is gone.
struct CodedMesh {
    std::uint32_t vertex_count = 0, triangle_count = 0;
    std::array<float, 3> min{}, max{};  ///< the box, world units
    /// For each axis x, y, z: the low bytes, then the high bytes, of each vertex's step from the one before, modulo
    /// 2^16. Vertices are in the order in which the triangles use them.
    std::vector<std::uint8_t> positions;
    /// Of each corner how far its vertex is behind the next one that is new, 7 bits a byte, the lowest first, all but
    /// the last with the bit 128: 0 is that new vertex.
    std::vector<std::uint8_t> corners;
    std::vector<std::uint32_t> from;  ///< the mesh's vertex for each coded one
};
[[nodiscard]] CodedMesh encode(const TriangleMesh& mesh);

/// What a browser makes of it.
[[nodiscard]] TriangleMesh decode(const CodedMesh& coded);

/// Values in 255 steps between the smallest and the largest; each byte is the step from the one before.
struct CodedValues {
    float min = 0, max = 0;
    std::vector<std::uint8_t> steps;
};
/// Of values[from[0]], values[from[1]], ...; what is not finite counts as the largest that is.
[[nodiscard]] CodedValues encode(const std::vector<float>& values, const std::vector<std::uint32_t>& from);

}  // namespace covol::detail
