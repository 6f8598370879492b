#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"

namespace covol {

/// Triangles over shared vertices, in world units; outward orientation is counter-clockwise seen from outside.
struct TriangleMesh {
    std::vector<std::array<float, 3>> vertices;  ///< relative to `origin`
    std::vector<std::array<std::uint32_t, 3>> triangles;
    /// World position of the vertices' origin: 0, unless the surface is too far from 0 for single precision, as clouds
    /// in national grid coordinates are.
    Vec3 origin{0, 0, 0};

    [[nodiscard]] bool empty() const noexcept { return triangles.empty(); }
    /// World position of a vertex.
    [[nodiscard]] Vec3 place(std::size_t vertex) const {
        const std::array<float, 3>& v = vertices[vertex];
        return {origin[0] + v[0], origin[1] + v[1], origin[2] + v[2]};
    }
};

/// Chooses the `origin` of a mesh within a box, with round coordinates; 0 if no coordinate of the box exceeds 2^17
/// times `finest`, the smallest length of interest, which single precision then divides into at least 128 steps.
[[nodiscard]] COVOL_API Vec3 choose_mesh_origin(const WorldBox& box, double finest);

/// Changes the origin of a mesh and its relative coordinates, so that the surface stays in place.
COVOL_API void move_mesh_origin(TriangleMesh& mesh, const Vec3& origin);

/// Properties of a mesh; volume and genus are meant for closed meshes.
struct MeshMeasures {
    double volume = 0;  ///< signed; positive when oriented outward
    double area = 0;
    int components = 0;     ///< number of parts whose triangles are connected by edges
    int genus = 0;          ///< sum over all components, from Euler's characteristic; -1 if the mesh is not closed
    bool closed = false;    ///< every edge belongs to exactly two triangles of opposite direction
    bool manifold = false;  ///< each vertex's triangles form one fan, and no edge has more than two triangles; the mesh
                            ///< need not be closed
};
[[nodiscard]] COVOL_API MeshMeasures measure(const TriangleMesh& mesh);

/// Distance of a mesh from the surface that it represents, in voxels.
struct MeshDeviation {
    double max = 0;
    double mean = 0;  ///< mean over the area
};

/// The 1st percentile of the triangles' smallest angles, degrees; 0 for an empty mesh.
[[nodiscard]] COVOL_API double smallest_angle(const TriangleMesh& mesh);

/// Unit normals at the vertices: means of the triangles' normals, weighted by their angles.
[[nodiscard]] COVOL_API std::vector<std::array<float, 3>> compute_vertex_normals(const TriangleMesh& mesh);

/// Removes unreferenced vertices, and components whose |volume| is below `min_volume`.
COVOL_API void remove_small_components(TriangleMesh& mesh, double min_volume);

}  // namespace covol
