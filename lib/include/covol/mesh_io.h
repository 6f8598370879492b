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

/// A number at each vertex: a float property in PLY; not stored in the other formats.
struct VertexAttribute {
    std::string name;  ///< one word
    std::vector<float> values;
};

struct WriteMeshOptions {
    bool binary = true;        ///< PLY, STL
    std::optional<bool> y_up;  ///< rotates z-up to y-up: (x,y,z) -> (x,z,-y); none: only for .glb, which is y-up
    double unit_scale = 1.0;   ///< multiplies coordinates; 0.001 for mm to m
    std::vector<std::string> comments;  ///< provenance lines, if the format has comments
    std::vector<VertexAttribute> attributes;
    std::function<void(const std::string& line)> warn;  ///< called with what the format cannot store
};

template <>
inline constexpr auto kOptions<WriteMeshOptions> =
    std::tuple{Option{"binary", &WriteMeshOptions::binary}, Option{"up", &WriteMeshOptions::y_up},
               Option{"unit_scale", &WriteMeshOptions::unit_scale, kPositive, Group::MeshFiles,
                      "multiplies the coordinates of the mesh, for example 0.001 for mm to m"}};

/// PLY, OBJ, STL, OFF or binary glTF (.glb), by the file extension; with normals if the format has them. A mesh with an
/// origin of its own has doubles in PLY and a translation in .glb; in binary STL it is written relative to the origin,
/// which is reported to `warn`. The file is written completely or not at all. @throws Error Io, InvalidOptions (unknown
/// extension).
COVOL_API void write_mesh(const std::string& path, const TriangleMesh& mesh, const WriteMeshOptions& options = {});

/// One of several meshes in a file.
struct NamedMesh {
    std::string name;
    TriangleMesh mesh;
    std::array<std::uint8_t, 3> color{187, 187, 187};  ///< red, green, blue; in .glb
};

/// Several meshes in one file: .obj (an object each) or .glb (a node with a material each), without attributes. The
/// file is written completely or not at all. @throws Error Io, InvalidOptions (another extension), InvalidInput (no
/// mesh).
COVOL_API void write_meshes(const std::string& path, const std::vector<NamedMesh>& meshes,
                            const WriteMeshOptions& options = {});

/// Whether write_meshes() can write the file, by the name alone.
[[nodiscard]] COVOL_API bool holds_several_meshes(const std::string& path);

/// PLY, OBJ, STL, OFF, binary glTF (all its meshes as one, rotated from y up to z up); polygons are split into
/// triangles. Sizes are checked before memory is allocated.
/// @throws Error Io, InvalidInput, Unsupported.
[[nodiscard]] COVOL_API TriangleMesh read_mesh(const std::string& path);

/// Whether read_mesh() can read the file, by the name alone.
[[nodiscard]] COVOL_API bool is_mesh_name(const std::string& path);

/// @throws Error InvalidOptions with the list of extensions that write_mesh knows.
COVOL_API void check_mesh_extension(const std::string& path);

}  // namespace covol
