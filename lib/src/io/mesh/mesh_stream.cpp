#include "io/mesh/mesh_stream.h"

#include <unistd.h>

#include <fstream>

#include "base/file.h"
#include "covol/error.h"
#include "io/mesh/mesh_formats.h"

namespace covol::mesh_io {
namespace {

class StlStream : public MeshStream {
public:
    StlStream(const std::string& path, const std::string& name, std::uint64_t triangles,
              const std::vector<std::string>& comments)
        : out_(path, name) {
        write_stl_header(out_, triangles, comments);
    }
    void vertex(const std::array<float, 3>&, const std::array<float, 3>&) override {}
    void triangle(const Face&, const std::array<std::array<float, 3>, 3>& corners) override {
        write_stl_facet(out_, corners);
    }
    void finish() override { out_.close(); }

private:
    Output out_;
};

/// Writes PLY and OBJ. Triangles may arrive before the last vertex, but follow the vertices in the file, so they are
/// stored in a temporary file until finish().
class IndexedStream : public MeshStream {
public:
    IndexedStream(const std::string& path, const std::string& name, bool ply, const PlyCounts& counts,
                  const Vec3& origin, const std::vector<std::string>& comments)
        : path_(path),
          name_(name),
          ply_(ply),
          places_(origin),
          faces_file_(path + ".faces"),
          out_(path, name),
          faces_(faces_file_, name) {
        if (ply)
            write_ply_header(out_, counts, places_.is_far(), comments, {}, true);
        else
            for (const std::string& comment : comments) out_ << "# " << comment << "\n";
    }
    ~IndexedStream() override { ::unlink(faces_file_.c_str()); }

    void vertex(const std::array<float, 3>& position, const std::array<float, 3>& normal) override {
        if (ply_) {
            places_.raw(out_, position);
            out_.raw(normal);
        } else {
            out_ << "v ";
            places_.text(out_, position);
            out_ << "\nvn " << normal << "\n";
        }
    }
    void triangle(const Face& vertices, const std::array<std::array<float, 3>, 3>&) override {
        if (ply_)
            write_ply_face(faces_, vertices);
        else
            write_obj_face(faces_, vertices, 1);
    }
    void finish() override {
        out_.close();
        faces_.close();
        std::ofstream whole(path_, std::ios::binary | std::ios::app);
        std::ifstream faces(faces_file_, std::ios::binary);
        // If the temporary file were empty, `<<` would set the error state of `whole`.
        if (faces.peek() != std::ifstream::traits_type::eof()) whole << faces.rdbuf();
        whole.close();
        if (!whole || faces.bad()) throw Error(Errc::Io, name_ + ": cannot be written");
    }

private:
    const std::string path_, name_;
    const bool ply_;
    const PositionWriter places_;
    const std::string faces_file_;
    Output out_, faces_;
};

}  // namespace

std::unique_ptr<MeshStream> MeshStream::open(const std::string& path, const std::string& name, std::uint64_t vertices,
                                             std::uint64_t triangles, const Vec3& origin,
                                             const std::vector<std::string>& comments) {
    const std::string end = detail::extension(name);
    if (end == ".stl") return std::make_unique<StlStream>(path, name, triangles, comments);
    if (end != ".ply" && end != ".obj")
        throw Error(Errc::InvalidOptions,
                    name + ": expected a name that ends in .ply, .stl or .obj, got '" + end + "'");
    return std::make_unique<IndexedStream>(path, name, end == ".ply", PlyCounts{vertices, triangles}, origin, comments);
}

}  // namespace covol::mesh_io
