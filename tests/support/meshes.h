#pragma once
#include <cstdint>

#include "covol/mesh.h"

namespace covol::test {

/// Both meshes in one, without merging vertices.
inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
    const auto shift = std::uint32_t(a.vertices.size());
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (const auto& t : b.triangles) a.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    return a;
}

}  // namespace covol::test
