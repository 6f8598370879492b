#pragma once
#include <cstdint>
#include <string>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/mesh.h"
#include "covol/mesh_io.h"
#include "covol/run.h"

namespace covol {

/// Size and properties of a mesh that was written.
struct StreamedMesh {
    std::uint64_t vertices = 0, triangles = 0;
    Vec3 origin{0, 0, 0};  ///< TriangleMesh::origin
    MeshMeasures measures;
};

/// Whether stream_mesh() writes files with this name: .ply, .stl and .obj.
[[nodiscard]] COVOL_API bool can_stream_mesh(const std::string& path);

/// Writes the mesh that extract_mesh() makes, with the same vertices and triangles in the same order, without holding
/// all of them in memory: one layer of leaves at a time is written to the file. In addition to the level set, this
/// takes about 400 bytes of memory for each leaf (a fifth of the leaf itself) and 4 bytes for each vertex.
///
/// Of the measures, volume, area and components are those of measure(); `closed` follows from a sum over the directed
/// edges that is 0 if each edge occurs in both directions; the genus follows from Euler's characteristic; `manifold` is
/// guaranteed by extract_mesh().
/// @param isovalue  world units
/// @param options   as for write_mesh(), but only binary and without attributes
/// @throws Error as extract_mesh() and write_mesh(); Unsupported (more vertices or triangles than the format allows);
///     InvalidInput (no surface at this level). No partial file remains.
COVOL_API StreamedMesh stream_mesh(const std::string& path, const FloatGrid& surface, double isovalue = 0.0,
                                   const WriteMeshOptions& options = {}, const RunContext& run = {});

/// The size and properties of the mesh that stream_mesh() would write. @throws Error as extract_mesh(); InvalidInput
/// (no surface at this level)
[[nodiscard]] COVOL_API StreamedMesh measure_surface(const FloatGrid& surface, double isovalue = 0.0,
                                                     const RunContext& run = {});

}  // namespace covol
