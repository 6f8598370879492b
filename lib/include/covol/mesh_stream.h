#pragma once
#include <cstdint>
#include <string>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/mesh.h"
#include "covol/mesh_io.h"
#include "covol/run.h"

namespace covol {

/// What was written, and how large it is.
struct StreamedMesh {
    std::uint64_t vertices = 0, triangles = 0;
    Vec3 origin{0, 0, 0};  ///< of the mesh
    MeshMeasures measures;
};

/// Whether stream_mesh() writes files of this name: .ply, .stl and .obj.
[[nodiscard]] COVOL_API bool can_stream_mesh(const std::string& path);

/// Writes the mesh that extract_mesh() makes, with the same vertices and triangles in the same order, and neither of
/// them is held: a layer of leaves at a time goes to the file. Beside the level set it takes some 400 bytes for each of
/// its leaves (a fifth of what the leaf takes) and 4 for each vertex.
///
/// measures: volume, area and components as measure() has them; `closed` by a sum over the directed edges that is 0
/// when each goes both ways; the genus from Euler's characteristic. `manifold` is what extract_mesh() guarantees.
/// @param isovalue  world units
/// @param options   those of write_mesh(); binary, without attributes
/// @throws Error as extract_mesh() and write_mesh(); Unsupported (more vertices or triangles than the format holds);
///               InvalidInput (no surface at this level). Nothing half-written stays.
COVOL_API StreamedMesh stream_mesh(const std::string& path, const FloatGrid& surface, double isovalue = 0.0,
                                   const WriteMeshOptions& options = {}, const RunContext& run = {});

/// What stream_mesh() would write. @throws Error as extract_mesh(); InvalidInput (no surface at this level)
[[nodiscard]] COVOL_API StreamedMesh measure_surface(const FloatGrid& surface, double isovalue = 0.0,
                                                     const RunContext& run = {});

}  // namespace covol
