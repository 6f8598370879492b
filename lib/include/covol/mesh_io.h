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

/// A number at each vertex: a float property in PLY; the other formats have no place for it.
struct VertexAttribute {
    std::string name;  ///< one word
    std::vector<float> values;
};

struct WriteMeshOptions {
    bool binary = true;                 ///< PLY, STL
    std::optional<bool> y_up;           ///< rotates z-up to y-up: (x,y,z) -> (x,z,-y); none: in .glb, which is y-up
    double unit_scale = 1.0;            ///< multiplies coordinates; 0.001 for mm to m
    std::vector<std::string> comments;  ///< provenance lines, where the format has comments
    std::vector<VertexAttribute> attributes;
    std::function<void(const std::string& line)> warn;  ///< hears of what the format cannot hold
};

template <>
inline constexpr auto kOptions<WriteMeshOptions> =
    std::tuple{Option{"binary", &WriteMeshOptions::binary}, Option{"up", &WriteMeshOptions::y_up},
               Option{"unit_scale", &WriteMeshOptions::unit_scale, kPositive, Group::MeshFiles,
                      "multiplies the mesh's coordinates, 0.001 for mm to m"}};

/// PLY, OBJ, STL, OFF or binary glTF (.glb), by the name's end; with normals where the format has them. Of a mesh with
/// an origin of its own PLY has doubles, .glb a translation; binary STL is relative to it, which `warn` hears.
/// Whole or not at all. @throws Error Io, InvalidOptions (unknown ending).
COVOL_API void write_mesh(const std::string& path, const TriangleMesh& mesh, const WriteMeshOptions& options = {});

/// One of several meshes in a file.
struct NamedMesh {
    std::string name;
    TriangleMesh mesh;
    std::array<std::uint8_t, 3> color{187, 187, 187};  ///< red, green, blue; in .glb
};

/// Several meshes in one file: .obj (an object each) or .glb (a node with a material each); attributes are not kept.
/// Whole or not at all. @throws Error Io, InvalidOptions (another ending), InvalidInput (no mesh).
COVOL_API void write_meshes(const std::string& path, const std::vector<NamedMesh>& meshes,
                            const WriteMeshOptions& options = {});

/// What write_meshes() can write, by the name alone.
[[nodiscard]] COVOL_API bool holds_several_meshes(const std::string& path);

/// PLY, OBJ, STL, OFF, binary glTF (all its meshes as one, turned from y up to z up); polygons are split into
/// triangles. Sizes are checked before memory is taken.
/// @throws Error Io, InvalidInput, Unsupported.
[[nodiscard]] COVOL_API TriangleMesh read_mesh(const std::string& path);

/// What read_mesh() reads, by the name alone.
[[nodiscard]] COVOL_API bool is_mesh_name(const std::string& path);

/// @throws Error InvalidOptions with the list of endings that write_mesh knows.
COVOL_API void check_mesh_extension(const std::string& path);

}  // namespace covol
