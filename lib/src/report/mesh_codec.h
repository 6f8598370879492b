#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "covol/mesh.h"

// Compact encoding of meshes. Browsers decode it in tools/viewer/src/data.js.
namespace covol::detail {

/// Vertices on a lattice of 65536 steps along each side of their box, without those that no triangle uses.
struct CodedMesh {
    std::uint32_t vertex_count = 0, triangle_count = 0;
    std::array<float, 3> min{}, max{};  ///< the box, world units
    /// For each axis x, y, z: the low bytes, then the high bytes, of the differences between each vertex and the
    /// previous one, modulo 2^16. Vertices are in the order in which the triangles use them.
    std::vector<std::uint8_t> positions;
    /// For each corner a number: the count of vertices used so far, minus the number of the corner's vertex, so that
    /// 0 is a new vertex. Numbers have 7 bits per byte, the lowest first; all bytes except the last have the bit 128.
    std::vector<std::uint8_t> corners;
    std::vector<std::uint32_t> from;  ///< for each coded vertex its number in the mesh
};
[[nodiscard]] CodedMesh encode(const TriangleMesh& mesh);

/// The mesh that a browser decodes.
[[nodiscard]] TriangleMesh decode(const CodedMesh& coded);

/// Values in 255 steps between their minimum and maximum; each byte is the difference from the previous value.
struct CodedValues {
    float min = 0, max = 0;
    std::vector<std::uint8_t> steps;
};
/// Encodes values[from[0]], values[from[1]], ...; values that are not finite count as the maximum of the others.
[[nodiscard]] CodedValues encode(const std::vector<float>& values, const std::vector<std::uint32_t>& from);

}  // namespace covol::detail
