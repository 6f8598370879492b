#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"

namespace covol {

/// Triangles over shared vertices, in world units; outward orientation is counter-clockwise seen from outside.
struct TriangleMesh {
    std::vector<std::array<float, 3>> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    [[nodiscard]] bool empty() const noexcept { return triangles.empty(); }
};

/// Facts about a mesh; volume and genus are meant for closed meshes.
struct MeshMeasures {
    double volume = 0;  ///< signed; positive when oriented outward
    double area = 0;
    int components = 0;     ///< edge-connected
    int genus = 0;          ///< total over all components, from Euler's characteristic; -1 when not closed
    bool closed = false;    ///< every edge belongs to exactly two triangles of opposite direction
    bool manifold = false;  ///< closed or not, each vertex's triangles form one fan and no edge has more than two
};
[[nodiscard]] COVOL_API MeshMeasures measure(const TriangleMesh& mesh);

/// How far a mesh is from the surface that it stands for, in voxels.
struct MeshDeviation {
    double max = 0;
    double mean = 0;  ///< over the area
};

/// The 1st percentile of the triangles' smallest angles, degrees; 0 of an empty mesh.
[[nodiscard]] COVOL_API double smallest_angle(const TriangleMesh& mesh);

/// Unit normals at the vertices, weighted by angle.
[[nodiscard]] COVOL_API std::vector<std::array<float, 3>> compute_vertex_normals(const TriangleMesh& mesh);

/// Drops unreferenced vertices and triangles of a component whose |volume| is below `min_volume`.
COVOL_API void remove_small_components(TriangleMesh& mesh, double min_volume);

}  // namespace covol
