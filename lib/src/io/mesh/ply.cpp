// PLY: ASCII and both byte orders, with elements and properties of any kind beside the mesh.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "covol/error.h"
#include "io/mesh/mesh_formats.h"

namespace covol::mesh_io {
namespace {

struct PlyType {
    char kind;  ///< 'i'nteger, 'u'nsigned, 'f'loat
    int size;
};
struct PlyProperty {
    std::string name;
    PlyType type;
    std::optional<PlyType> count;  ///< of a list
};
struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;
};
enum class PlyFormat { Ascii, Little, Big };

PlyType ply_type(const Source& source, std::string_view name) {
    static constexpr struct {
        std::string_view name;
        PlyType type;
    } kTypes[] = {{"char", {'i', 1}},  {"int8", {'i', 1}},   {"uchar", {'u', 1}},   {"uint8", {'u', 1}},
                  {"short", {'i', 2}}, {"int16", {'i', 2}},  {"ushort", {'u', 2}},  {"uint16", {'u', 2}},
                  {"int", {'i', 4}},   {"int32", {'i', 4}},  {"uint", {'u', 4}},    {"uint32", {'u', 4}},
                  {"float", {'f', 4}}, {"float32", {'f', 4}}, {"double", {'f', 8}}, {"float64", {'f', 8}}};
    for (const auto& known : kTypes)
        if (known.name == name) return known.type;
    source.fail("unknown PLY type '" + std::string(name.substr(0, 40)) + "'");
}

class PlyReader {
public:
    explicit PlyReader(Source& source) : source_(source) {}

    TriangleMesh read() {
        read_header();
        MeshBuilder mesh(source_);
        for (const PlyElement& element : elements_) {
            check_size(element);
            if (element.name == "vertex") read_vertices(element, mesh);
            else if (element.name == "face") read_faces(element, mesh);
            else for_each_row(element, [](std::size_t, const std::vector<double>&) {}, [] {});
        }
        return mesh.finish();
    }

private:
    void read_header() {
        if (source_.line() != "ply") source_.fail("expected 'ply' in the first line");
        for (;;) {
            std::string_view line = source_.line();
            const std::string_view key = next_word(line);
            if (key == "end_header") return;
            if (key == "format") {
                const std::string_view name = next_word(line);
                if (name == "ascii") format_ = PlyFormat::Ascii;
                else if (name == "binary_little_endian") format_ = PlyFormat::Little;
                else if (name == "binary_big_endian") format_ = PlyFormat::Big;
                else source_.fail("unknown PLY format '" + std::string(name.substr(0, 40)) + "'");
            } else if (key == "element") {
                PlyElement element;
                element.name = next_word(line);
                element.count = source_.number<std::uint64_t>(line, "the element's count");
                elements_.push_back(element);
            } else if (key == "property") {
                if (elements_.empty()) source_.fail("a property before any element");
                PlyProperty property;
                std::string_view type = next_word(line);
                if (type == "list") {
                    property.count = ply_type(source_, next_word(line));
                    type = next_word(line);
                }
                property.type = ply_type(source_, type);
                property.name = next_word(line);
                elements_.back().properties.push_back(property);
            } else if (key != "comment" && key != "obj_info") {
                source_.fail("unknown PLY header line '" + std::string(key.substr(0, 40)) + "'");
            }
        }
    }

    /// Refuses counts that the rest of the file has no room for, before any memory is taken.
    void check_size(const PlyElement& element) const {
        std::uint64_t least = 0;
        for (const PlyProperty& property : element.properties)
            least += format_ == PlyFormat::Ascii ? 2 : std::uint64_t(property.count ? property.count->size : property.type.size);
        // The last line of a text may lack its end.
        if (least > 0 && element.count > (source_.bytes_left() + 1) / least)
            source_.fail("the header promises " + std::to_string(element.count) + " of element '" + element.name +
                         "', the file has room for at most " + std::to_string((source_.bytes_left() + 1) / least));
    }

    double value(PlyType type, std::string_view& line) {
        if (format_ == PlyFormat::Ascii) return source_.number<double>(line, "a number");
        std::array<char, 8> raw{};
        std::memcpy(raw.data(), source_.bytes(std::size_t(type.size)).data(), std::size_t(type.size));
        if (format_ == PlyFormat::Big) std::reverse(raw.begin(), raw.begin() + type.size);
        const auto as = [&](auto number) {
            std::memcpy(&number, raw.data(), sizeof(number));
            return double(number);
        };
        if (type.kind == 'f') return type.size == 4 ? as(float{}) : as(double{});
        if (type.kind == 'i') return type.size == 1 ? as(std::int8_t{}) : type.size == 2 ? as(std::int16_t{}) : as(std::int32_t{});
        return type.size == 1 ? as(std::uint8_t{}) : type.size == 2 ? as(std::uint16_t{}) : as(std::uint32_t{});
    }

    /// Calls visit(property, values) for each property of each row, then end() for the row.
    template <typename Visit, typename End>
    void for_each_row(const PlyElement& element, const Visit& visit, const End& end) {
        std::vector<double> values;
        for (std::uint64_t row = 0; !element.properties.empty() && row < element.count; ++row) {
            std::string_view line = format_ == PlyFormat::Ascii ? source_.line() : std::string_view();
            for (std::size_t p = 0; p < element.properties.size(); ++p) {
                const PlyProperty& property = element.properties[p];
                const double count = property.count ? value(*property.count, line) : 1;
                if (!(count >= 0 && count <= double(source_.bytes_left() + line.size())))
                    source_.fail("a list of " + std::to_string(count) + " entries");
                values.clear();
                for (std::size_t i = 0; i < std::size_t(count); ++i) values.push_back(value(property.type, line));
                visit(p, values);
            }
            end();
        }
    }

    void read_vertices(const PlyElement& element, MeshBuilder& mesh) {
        std::array<std::size_t, 3> column{};
        for (int a = 0; a < 3; ++a) {
            const std::string name(1, char('x' + a));
            const auto at = std::find_if(element.properties.begin(), element.properties.end(),
                                         [&](const PlyProperty& p) { return p.name == name && !p.count; });
            if (at == element.properties.end()) source_.fail("the vertices have no property '" + name + "'");
            column[a] = std::size_t(at - element.properties.begin());
        }
        mesh.reserve_vertices(element.count);
        Vec3 position{};
        for_each_row(
            element,
            [&](std::size_t p, const std::vector<double>& values) {
                for (int a = 0; a < 3; ++a)
                    if (column[a] == p) position[a] = values[0];
            },
            [&] { mesh.vertex(position[0], position[1], position[2]); });
    }

    void read_faces(const PlyElement& element, MeshBuilder& mesh) {
        const auto at = std::find_if(element.properties.begin(), element.properties.end(), [](const PlyProperty& p) {
            return p.count && (p.name == "vertex_indices" || p.name == "vertex_index");
        });
        if (at == element.properties.end() && element.count > 0) source_.fail("the faces have no list 'vertex_indices'");
        const auto list = std::size_t(at - element.properties.begin());
        std::vector<std::uint32_t> corners;
        for_each_row(
            element,
            [&](std::size_t p, const std::vector<double>& values) {
                if (p != list) return;
                corners.clear();
                for (const double v : values) corners.push_back(to_index(source_, v));
            },
            [&] { mesh.polygon(corners); });
    }

    Source& source_;
    PlyFormat format_ = PlyFormat::Ascii;
    std::vector<PlyElement> elements_;
};

}  // namespace

TriangleMesh read_ply(Source& source) { return PlyReader(source).read(); }

void write_ply(Output& out, const Prepared& in) {
    out << "ply\nformat " << (in.binary ? "binary_little_endian" : "ascii") << " 1.0\n";
    for (const std::string& comment : in.comments) out << "comment " << comment << "\n";
    out << "element vertex " << std::uint64_t(in.mesh.vertices.size()) << "\n";
    for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) out << "property float " << name << "\n";
    for (const VertexAttribute& attribute : in.attributes) out << "property float " << attribute.name << "\n";
    out << "element face " << std::uint64_t(in.mesh.triangles.size()) << "\nproperty list uchar uint vertex_indices\nend_header\n";
    for (std::size_t v = 0; v < in.mesh.vertices.size(); ++v) {
        if (in.binary) {
            out.raw(in.mesh.vertices[v]);
            out.raw(in.normals[v]);
            for (const VertexAttribute& attribute : in.attributes) out.raw(attribute.values[v]);
        } else {
            out << in.mesh.vertices[v] << " " << in.normals[v];
            for (const VertexAttribute& attribute : in.attributes) out << " " << attribute.values[v];
            out << "\n";
        }
    }
    for (const Face& t : in.mesh.triangles) {
        if (in.binary) {
            out.raw(std::uint8_t(3));
            out.raw(t);
        } else {
            out << "3 " << std::uint64_t(t[0]) << " " << std::uint64_t(t[1]) << " " << std::uint64_t(t[2]) << "\n";
        }
    }
}

}  // namespace covol::mesh_io
