#pragma once
#include <string>
#include <vector>

#include "covol/mesh.h"

namespace covol {

struct WriteMeshOptions {
    bool binary = true;                 ///< PLY, STL
    bool y_up = false;                  ///< rotates z-up to y-up: (x,y,z) -> (x,z,-y)
    double unit_scale = 1.0;            ///< multiplies coordinates; 0.001 for mm to m
    std::vector<std::string> comments;  ///< provenance lines, where the format has comments
};

/// PLY, OBJ, STL, OFF or binary glTF (.glb), by the name's end; with normals where the format has them.
/// Whole or not at all. @throws Error Io, InvalidOptions (unknown ending).
void write_mesh(const std::string& path, const TriangleMesh& mesh, const WriteMeshOptions& options = {});

/// PLY, OBJ, STL, OFF; polygons are split into triangles. Sizes are checked before memory is taken.
/// @throws Error Io, InvalidInput, Unsupported.
[[nodiscard]] TriangleMesh read_mesh(const std::string& path);

/// @throws Error InvalidOptions with the list of endings that write_mesh knows.
void check_mesh_extension(const std::string& path);

}  // namespace covol
