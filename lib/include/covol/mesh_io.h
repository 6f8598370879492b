#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/mesh.h"
#include "covol/options_table.h"

namespace covol {

/// A number for each vertex. PLY stores it as a float property; the other formats do not store it.
struct VertexAttribute {
    std::string name;  ///< one word
    std::vector<float> values;
};

struct WriteMeshOptions {
    bool binary = true;  ///< for PLY and STL; false: these are written as text
    /// rotates from z up to y up: (x,y,z) -> (x,z,-y); none: only for .glb, whose y axis points up
    std::optional<bool> y_up;
    double unit_scale = 1.0;            ///< factor of the coordinates, for example 0.001 for mm to m
    std::vector<std::string> comments;  ///< provenance lines, if the format has comments
    std::vector<VertexAttribute> attributes;
    std::function<void(const std::string& line)> warn;  ///< called with a line about data that the format cannot store
};

template <>
inline constexpr auto kOptions<WriteMeshOptions> =
    std::tuple{Option{"binary", &WriteMeshOptions::binary}, Option{"up", &WriteMeshOptions::y_up},
               Option{"unit_scale", &WriteMeshOptions::unit_scale, kPositive, Group::MeshFiles,
                      "multiplies the coordinates of the mesh, for example 0.001 for mm to m"}};

/// Writes PLY, OBJ, STL, OFF or binary glTF (.glb), by the file extension, with normals if the format has them. If the
/// mesh's origin is not 0, PLY stores coordinates as doubles and .glb a translation; binary STL stores coordinates
/// relative to the origin, which is reported to `warn`. The file is written completely or not at all. @throws Error Io,
/// InvalidOptions (unknown extension).
COVOL_API void write_mesh(const std::string& path, const TriangleMesh& mesh, const WriteMeshOptions& options = {});

/// One of several meshes in a file.
struct NamedMesh {
    std::string name;
    TriangleMesh mesh;
    std::array<std::uint8_t, 3> color{187, 187, 187};  ///< red, green, blue; only stored in .glb
};

/// Writes several meshes to one file, .obj (one object for each) or .glb (one node with a material for each), without
/// attributes. The file is written completely or not at all. @throws Error Io, InvalidOptions (another extension),
/// InvalidInput (no mesh).
COVOL_API void write_meshes(const std::string& path, const std::vector<NamedMesh>& meshes,
                            const WriteMeshOptions& options = {});

/// Whether write_meshes() can write the file, by the name alone.
[[nodiscard]] COVOL_API bool holds_several_meshes(const std::string& path);

/// Reads PLY, OBJ, STL, OFF or binary glTF (all its meshes as one, rotated from y up to z up); polygons are split into
/// triangles. Sizes are checked before memory is allocated.
/// @throws Error Io, InvalidInput, Unsupported.
[[nodiscard]] COVOL_API TriangleMesh read_mesh(const std::string& path);

/// Whether read_mesh() can read the file, by the name alone.
[[nodiscard]] COVOL_API bool is_mesh_name(const std::string& path);

/// Checks by the name alone that write_mesh() can write the file. @throws Error InvalidOptions with the list of
/// extensions.
COVOL_API void check_mesh_extension(const std::string& path);

}  // namespace covol
