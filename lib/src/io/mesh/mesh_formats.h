#pragma once
// A reader and a writer for each format of meshes. The readers of PLY, OBJ and OFF are also used for clouds.
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/mesh/mesh_builder.h"
#include "io/mesh/mesh_output.h"
#include "io/mesh/mesh_source.h"

namespace covol::mesh_io {

/// The readers check counts in the file against the file's size before they pass them to the receiver.
/// @param source  the file's text from its beginning; errors state the position in it
/// @throws Error InvalidInput, Unsupported; and whatever the receiver throws.
void read_ply(Source& source, Receiver& receiver);
void read_obj(Source& source, Receiver& receiver);
void read_off(Source& source, Receiver& receiver);
/// @param text  the whole file, whose size distinguishes binary from ASCII
[[nodiscard]] TriangleMesh read_stl(Source& source, std::string_view text);
[[nodiscard]] TriangleMesh read_glb(Source& source, std::string_view text);

void write_ply(Output& out, const Prepared& in);
void write_obj(Output& out, const Prepared& in);
void write_off(Output& out, const Prepared& in);
void write_stl(Output& out, const Prepared& in);
void write_glb(Output& out, const Prepared& in);

/// Replaces the line breaks within each comment with blanks, and applies safe_text().
std::vector<std::string> one_line_each(std::vector<std::string> comments);
/// Scales a vertex or a mesh's origin, and rotates it if the options require that y points up.
template <typename Real>
std::array<Real, 3> placed(const std::array<Real, 3>& vertex, const WriteMeshOptions& options) {
    std::array<Real, 3> p = vertex;
    for (Real& c : p) c = Real(c * options.unit_scale);
    if (options.y_up.value_or(false)) p = {p[0], p[2], -p[1]};
    return p;
}

/// Warns that the coordinates in a binary STL file are relative to the origin of the mesh, unless the origin is 0. STL
/// has only single precision, so the origin cannot be added. There is no warning for other formats.
void report_origin(const std::string& path, const Vec3& origin, const WriteMeshOptions& options);

/// The numbers of vertices and triangles that write_ply_header() writes. This function writes a PLY file up to its
/// vertices. @throws Error Unsupported (more than 2^31 - 1 vertices or triangles).
struct PlyCounts {
    std::uint64_t vertices, triangles;
};
void write_ply_header(Output& out, const PlyCounts& counts, bool is_far, const std::vector<std::string>& comments,
                      const std::vector<VertexAttribute>& attributes, bool binary);
void write_ply_face(Output& out, const Face& triangle);
/// Writes the beginning of a binary STL file. @throws Error Unsupported (more than 2^32 - 1 triangles).
void write_stl_header(Output& out, std::uint64_t triangles, const std::vector<std::string>& comments);
void write_stl_facet(Output& out, const std::array<std::array<float, 3>, 3>& corners);
/// @param first  the index of the mesh's first vertex in the file, from 1
void write_obj_face(Output& out, const Face& triangle, std::uint64_t first);

/// Writes one of several meshes of a file. @param first  the index of the mesh's first vertex in the file, from 1
void write_obj_object(Output& out, const Prepared& in, std::uint64_t first);

/// One mesh of a .glb file. If `named` is null, the mesh has no name and no material.
struct GlbPart {
    const Prepared* in;
    const NamedMesh* named;
};

/// Writes the meshes to one .glb file. @throws Error Unsupported (more than 4 GB).
void write_glb_parts(Output& out, const std::vector<GlbPart>& parts, const std::vector<std::string>& comments);

}  // namespace covol::mesh_io
