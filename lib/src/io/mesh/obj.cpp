// OBJ, its polygons as fans.
#include <optional>
#include <string>
#include <vector>

#include "covol/error.h"
#include "io/mesh/mesh_formats.h"

namespace covol::mesh_io {

TriangleMesh read_obj(Source& source) {
    MeshBuilder mesh(source);
    std::vector<std::uint32_t> corners;
    while (!source.at_end()) {
        std::string_view line = source.line();
        const std::string_view key = next_word(line);
        if (key == "v") {
            Vec3 p{};
            for (double& c : p) c = source.number<double>(line, "a coordinate");
            mesh.vertex(p[0], p[1], p[2]);
        } else if (key == "f") {
            corners.clear();
            for (std::string_view word = next_word(line); !word.empty() && word[0] != '#'; word = next_word(line)) {
                const auto number = to_number<std::int64_t>(word.substr(0, word.find('/')));
                // From 1, or from the end when negative.
                if (!number || *number == 0)
                    source.fail("expected the number of a vertex, got '" + std::string(word.substr(0, 40)) + "'");
                corners.push_back(to_index(source, double(*number > 0 ? *number - 1 : std::int64_t(mesh.vertex_count()) + *number)));
            }
            if (corners.size() < 3) source.fail("expected a face of at least 3 vertices, got " + std::to_string(corners.size()));
            mesh.polygon(corners);
        }
    }
    return mesh.finish();
}

void write_obj_object(Output& out, const Prepared& in, std::uint64_t first) {
    for (const auto& p : in.mesh.vertices) out << "v " << p << "\n";
    for (const auto& n : in.normals) out << "vn " << n << "\n";
    for (const Face& t : in.mesh.triangles) {
        out << "f";
        for (const std::uint32_t v : t) out << " " << first + v << "//" << first + v;
        out << "\n";
    }
}

void write_obj(Output& out, const Prepared& in) {
    for (const std::string& comment : in.comments) out << "# " << comment << "\n";
    write_obj_object(out, in, 1);
}

}  // namespace covol::mesh_io
