// Reads the vertices of PLY, OBJ and OFF files, with their normals, as clouds. The parsers are those of the mesh
// readers.
#include <string>

#include "io/mesh/mesh_formats.h"
#include "io/points/point_formats.h"

namespace covol::detail {
namespace {

class CloudBuilder final : public mesh_io::Receiver {
public:
    CloudBuilder(const mesh_io::Source& source, PointTable& table) : source_(source), table_(table) {}

    [[nodiscard]] bool wants_normals() const override { return true; }
    void expect_vertices(std::size_t count, bool with_normals) override {
        expects_vertices_ = true;
        table_.points.reserve(count);
        if (with_normals) table_.normals.reserve(count);
    }
    void vertex(const Vec3& position) override {
        source_.check_finite(table_.points.size(), position[0], position[1], position[2]);
        table_.points.push_back(position);
    }
    void normal(const Vec3& direction) override { table_.normals.push_back(normal_of(direction)); }
    void mixed_normals() override { mixed_normals_ = true; }

    [[nodiscard]] bool expects_vertices() const { return expects_vertices_; }
    /// Removes the normals unless each point has exactly one.
    void finish() {
        if (mixed_normals_ || table_.normals.size() != table_.points.size()) table_.normals.clear();
    }

private:
    const mesh_io::Source& source_;
    PointTable& table_;
    bool expects_vertices_ = false, mixed_normals_ = false;
};

PointTable read_vertices(const char* rule, const std::string& path, const std::string& content,
                         void (*read)(mesh_io::Source&, mesh_io::Receiver&)) {
    PointTable table;
    table.rule = rule;
    mesh_io::Source source(path, content);
    CloudBuilder builder(source, table);
    read(source, builder);
    if (read == mesh_io::read_ply && !builder.expects_vertices()) source.fail("expected an element 'vertex', got none");
    builder.finish();
    return table;
}

}  // namespace

PointTable parse_ply(const std::string& path, const std::string& bytes) {
    return read_vertices("vertices of a PLY", path, bytes, mesh_io::read_ply);
}
PointTable parse_obj(const std::string& path, const std::string& text) {
    return read_vertices("vertices of an OBJ", path, text, mesh_io::read_obj);
}
PointTable parse_off(const std::string& path, const std::string& text) {
    return read_vertices("vertices of an OFF", path, text, mesh_io::read_off);
}

}  // namespace covol::detail
