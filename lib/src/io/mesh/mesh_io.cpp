#include "covol/mesh_io.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iomanip>
#include <sstream>
#include <string_view>

#include "base/file.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "covol/safe_text.h"
#include "files/atomic.h"
#include "io/mesh/mesh_formats.h"
#include "mesh/missing_vertex.h"
#include "mesh/vertex_normals.h"

// These readers and writers replace those of OpenMesh: its readers trust the counts in a file's header, omit triangles
// that would make the mesh non-manifold and print messages about them, and its writers do not support comments.
namespace covol {
namespace {

using namespace mesh_io;

std::string read_file(const std::string& path) {
    std::error_code status;
    const auto size = std::filesystem::file_size(path, status);
    if (status) throw Error(Errc::Io, path + ": cannot be opened: " + status.message());
    std::ifstream file = open_regular_file(path);
    std::string text(size, '\0');
    if (!file || !file.read(text.data(), std::streamsize(size))) throw Error(Errc::Io, path + ": cannot be read");
    return text;
}

void check_references(const TriangleMesh& mesh) {
    for (const Face& t : mesh.triangles)
        for (const std::uint32_t v : t)
            if (v >= mesh.vertices.size())
                throw Error(Errc::InvalidInput, "a triangle " + detail::refers_to_missing(v, mesh.vertices.size()));
}

void check_attribute(const VertexAttribute& attribute, const TriangleMesh& mesh) {
    const std::string& name = attribute.name;
    if (name.empty() || std::any_of(name.begin(), name.end(), [](unsigned char c) { return c <= ' '; }))
        throw Error(Errc::InvalidInput, "expected an attribute's name of one word, got '" + name + "'");
    if (attribute.values.size() != mesh.vertices.size())
        throw Error(Errc::InvalidInput, "attribute " + name + ": expected " + std::to_string(mesh.vertices.size()) +
                                            " values, one for each vertex, got " +
                                            std::to_string(attribute.values.size()));
}

Prepared prepare(const std::string& extension, const TriangleMesh& mesh, const WriteMeshOptions& options) {
    require_valid(options, "write_mesh");
    check_references(mesh);
    for (const VertexAttribute& attribute : options.attributes) check_attribute(attribute, mesh);
    WriteMeshOptions placing = options;
    placing.y_up = options.y_up.value_or(extension == ".glb");
    Prepared result{mesh.triangles,
                    mesh.vertices,
                    PositionWriter(placed(mesh.origin, placing)),
                    {},
                    one_line_each(options.comments),
                    options.attributes,
                    options.binary};
    for (auto& p : result.vertices) p = placed(p, placing);
    if (extension == ".ply" || extension == ".obj" || extension == ".glb")
        result.normals = meshing::vertex_normals(result.vertices, mesh.triangles);
    return result;
}

using Writer = void (*)(Output&, const Prepared&);

Writer writer_of(const std::string& path) {
    static constexpr struct {
        std::string_view extension;
        Writer writer;
    } kWriters[] = {
        {".ply", write_ply}, {".obj", write_obj}, {".stl", write_stl}, {".off", write_off}, {".glb", write_glb}};
    const std::string end = detail::extension(path);
    for (const auto& known : kWriters)
        if (known.extension == end) return known.writer;
    throw Error(Errc::InvalidOptions,
                path + ": expected a name that ends in .ply, .obj, .stl, .off or .glb, got '" + end + "'");
}

void save(const std::string& path, const std::function<void(Output& out)>& write) {
    detail::write_atomically(path, [&](const std::string& temporary) {
        Output out(temporary, path);
        write(out);
        out.close();
    });
}

}  // namespace

std::vector<std::string> mesh_io::one_line_each(std::vector<std::string> comments) {
    for (std::string& comment : comments)
        std::replace_if(
            comment.begin(), comment.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
    std::transform(comments.begin(), comments.end(), comments.begin(),
                   [](const std::string& c) { return safe_text(c); });
    return comments;
}

void mesh_io::report_origin(const std::string& path, const Vec3& origin, const WriteMeshOptions& options) {
    if (origin == Vec3{0, 0, 0} || detail::extension(path) != ".stl" || !options.binary || !options.warn) return;
    std::ostringstream text;
    text << std::setprecision(15) << origin[0] << ", " << origin[1] << ", " << origin[2];
    options.warn(path + ": STL stores single precision only, so coordinates are relative to (" + text.str() +
                 "); .ply, .obj and .glb store the full coordinates");
}

void check_mesh_extension(const std::string& path) { static_cast<void>(writer_of(path)); }

void write_mesh(const std::string& path, const TriangleMesh& mesh, const WriteMeshOptions& options) {
    const Writer writer = writer_of(path);
    const Prepared prepared = prepare(detail::extension(path), mesh, options);
    report_origin(path, mesh.origin, options);
    save(path, [&](Output& out) { writer(out, prepared); });
}

bool holds_several_meshes(const std::string& path) {
    const std::string end = detail::extension(path);
    return end == ".obj" || end == ".glb";
}

void write_meshes(const std::string& path, const std::vector<NamedMesh>& meshes, const WriteMeshOptions& options) {
    if (!holds_several_meshes(path))
        throw Error(Errc::InvalidOptions, path + ": expected a name that ends in .obj or .glb");
    if (meshes.empty()) throw Error(Errc::InvalidInput, path + ": expected a mesh, got none");
    WriteMeshOptions bare = options;
    bare.attributes.clear();
    std::vector<Prepared> prepared;
    prepared.reserve(meshes.size());
    for (const NamedMesh& named : meshes) prepared.push_back(prepare(detail::extension(path), named.mesh, bare));
    const std::vector<std::string>& comments = prepared.front().comments;
    save(path, [&](Output& out) {
        if (detail::extension(path) == ".glb") {
            std::vector<GlbPart> parts;
            for (std::size_t n = 0; n < meshes.size(); ++n) parts.push_back({&prepared[n], &meshes[n]});
            return write_glb_parts(out, parts, comments);
        }
        for (const std::string& comment : comments) out << "# " << comment << "\n";
        std::uint64_t first = 1;
        for (std::size_t n = 0; n < meshes.size(); ++n) {
            out << "o " << one_line_each({meshes[n].name}).front() << "\n";
            write_obj_object(out, prepared[n], first);
            first += prepared[n].vertices.size();
        }
    });
}

bool is_mesh_name(const std::string& path) {
    const std::string end = detail::extension(path);
    return end == ".ply" || end == ".obj" || end == ".stl" || end == ".off" || end == ".glb";
}

TriangleMesh read_mesh(const std::string& path) {
    const std::string end = detail::extension(path);
    if (!is_mesh_name(path))
        throw Error(Errc::Unsupported,
                    path + ": expected a name that ends in .ply, .obj, .stl, .off or .glb, got '" + end + "'");
    const std::string text = read_file(path);
    Source source(path, text);
    const auto built = [&](void (*read)(Source&, Receiver&)) {
        MeshBuilder builder(source);
        read(source, builder);
        return builder.finish();
    };
    TriangleMesh mesh = end == ".ply"   ? built(read_ply)
                        : end == ".obj" ? built(read_obj)
                        : end == ".stl" ? read_stl(source, text)
                        : end == ".glb" ? read_glb(source, text)
                                        : built(read_off);
    if (mesh.empty()) throw Error(Errc::InvalidInput, path + ": the file has no triangle");
    return mesh;
}

}  // namespace covol
