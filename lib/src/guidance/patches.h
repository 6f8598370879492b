#pragma once
#include <cstdint>
#include <vector>

#include "covol/image.h"
#include "covol/mesh.h"

namespace covol::guidance {

/// A surface's vertices: the data that do not depend on how it is cut into patches.
struct SurfaceVertices {
    std::vector<Vec3> places, normals;
    std::vector<double> area;                      ///< a third of the area of the triangles around it
    std::vector<std::uint32_t> first, neighbours;  ///< of vertex v, each once: neighbours[first[v] .. first[v+1])
};

/// @param mesh    closed, with outward normals
/// @param smooth  distance over which normals are averaged, voxels
[[nodiscard]] SurfaceVertices vertices_of(const TriangleMesh& mesh, double smooth);

/// A surface cut into patches about two voxels wide, each with a single offset.
struct Patches {
    // by vertex:
    std::vector<Vec3> places, normals;
    std::vector<std::uint32_t> patch;
    // by patch:
    std::vector<std::uint32_t> first, members;  ///< patch p has the vertices members[first[p] .. first[p+1])
    std::vector<Vec3> centers, directions;      ///< mean position and mean normal of its vertices
    std::vector<double> area;
    std::vector<double> voxel;  ///< voxel_along() the patch's normal, world units
    struct Border {
        std::uint32_t a, b;
        double length, distance;
    };
    std::vector<Border> borders;
    std::vector<std::vector<std::uint32_t>> neighbours;  ///< by patch: the patches with which it has a border

    [[nodiscard]] std::size_t size() const { return centers.size(); }
};

/// Cuts a surface into patches without computing borders, so that it may be cut more than once before find_borders().
/// @param width   of the patches, world units; along each axis of the image at least one voxel is used
[[nodiscard]] Patches cut_patches(const SurfaceVertices& vertices, const ImageGeometry& geometry, double width);

/// Sets the borders, neighbours, places and normals of patches. @param vertices  those from which cut_patches() made
/// them
void find_borders(SurfaceVertices&& vertices, Patches& patches);

/// Interpolates values of patches to a smooth function on the vertices.
/// @param width  of the patches, world units
[[nodiscard]] std::vector<double> on_vertices(const Patches& patches, double width,
                                              const std::vector<double>& by_patch);

/// The size of the image's voxels along a unit vector, world units: the root mean square of their edges, weighted by
/// the squared components of the vector along the edges.
[[nodiscard]] double voxel_along(const ImageGeometry& geometry, const Vec3& direction);

}  // namespace covol::guidance
