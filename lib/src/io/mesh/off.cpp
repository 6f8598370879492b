// OFF, its polygons as fans.
#include <string>
#include <vector>

#include "covol/error.h"
#include "io/mesh/mesh_formats.h"

namespace covol::mesh_io {

TriangleMesh read_off(Source& source) {
    std::string_view line = source.content_line();
    const std::string_view key = next_word(line);
    if (key != "OFF" && key != "COFF" && key != "NOFF" && key != "CNOFF")
        source.fail("expected 'OFF' in the first line, got '" + std::string(key.substr(0, 40)) + "'");
    if (line.find_first_not_of(" \t") == std::string_view::npos) line = source.content_line();
    const auto vertices = source.number<std::uint64_t>(line, "the number of vertices");
    const auto faces = source.number<std::uint64_t>(line, "the number of faces");
    // "0 0 0" and its line's end are the shortest vertex, a face is no shorter than "0".
    if (vertices > (source.bytes_left() + 1) / 6 || faces > (source.bytes_left() + 1) / 2)
        source.fail("the header promises " + std::to_string(vertices) + " vertices and " + std::to_string(faces) +
                    " faces, more than the file has room for");
    MeshBuilder mesh(source);
    mesh.reserve_vertices(vertices);
    for (std::uint64_t i = 0; i < vertices; ++i) {
        line = source.content_line();
        Vec3 p{};
        for (double& c : p) c = source.number<double>(line, "a coordinate");
        mesh.vertex(p[0], p[1], p[2]);
    }
    std::vector<std::uint32_t> corners;
    for (std::uint64_t i = 0; i < faces; ++i) {
        line = source.content_line();
        const auto count = source.number<std::uint64_t>(line, "the number of a face's vertices");
        if (count > line.size()) source.fail("a face of " + std::to_string(count) + " vertices in a shorter line");
        corners.clear();
        for (std::uint64_t k = 0; k < count; ++k)
            corners.push_back(to_index(source, source.number<double>(line, "the number of a vertex")));
        mesh.polygon(corners);
    }
    return mesh.finish();
}

void write_off(Output& out, const Prepared& in) {
    out << "OFF\n";
    for (const std::string& comment : in.comments) out << "# " << comment << "\n";
    out << std::uint64_t(in.mesh.vertices.size()) << " " << std::uint64_t(in.mesh.triangles.size()) << " 0\n";
    for (const auto& p : in.mesh.vertices) out << p << "\n";
    for (const Face& t : in.mesh.triangles)
        out << "3 " << std::uint64_t(t[0]) << " " << std::uint64_t(t[1]) << " " << std::uint64_t(t[2]) << "\n";
}

}  // namespace covol::mesh_io
