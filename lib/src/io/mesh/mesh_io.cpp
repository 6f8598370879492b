#include "covol/mesh_io.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <unordered_map>

#include "base/file.h"
#include "covol/error.h"

// Own readers and writers: OpenMesh's readers trust the counts in a file's header, drop triangles that are not manifold
// and print about it, and its writers have no comments.
namespace covol {
namespace {

static_assert(std::endian::native == std::endian::little, "binary mesh files are written in the machine's byte order");

using Face = std::array<std::uint32_t, 3>;

// ---------------------------------------------------------------------------------------------------------------- reading

std::string read_file(const std::string& path) {
    std::error_code status;
    const auto size = std::filesystem::file_size(path, status);
    if (status) throw Error(Errc::Io, "read_mesh: " + path + ": cannot be opened: " + status.message());
    std::ifstream file(path, std::ios::binary);
    std::string text(size, '\0');
    if (!file || !file.read(text.data(), std::streamsize(size)))
        throw Error(Errc::Io, "read_mesh: " + path + ": cannot be read");
    return text;
}

std::string_view next_word(std::string_view& line) {
    const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
    std::size_t begin = 0;
    while (begin < line.size() && is_space(line[begin])) ++begin;
    std::size_t end = begin;
    while (end < line.size() && !is_space(line[end])) ++end;
    const std::string_view word = line.substr(begin, end - begin);
    line.remove_prefix(end);
    return word;
}

template <typename T>
std::optional<T> to_number(std::string_view word) {
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
}

/// A file in memory, read line by line or byte by byte; knows where it is for messages.
class Source {
public:
    Source(const std::string& path, std::string_view text) : path_(path), rest_(text) {}

    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] bool at_end() const { return rest_.empty(); }
    [[nodiscard]] std::size_t bytes_left() const { return rest_.size(); }

    std::string_view line() {
        if (rest_.empty()) fail("unexpected end of the file");
        const std::size_t end = rest_.find('\n');
        std::string_view line = rest_.substr(0, end);
        rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
        ++line_;
        if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
        return line;
    }

    /// The next line that is neither blank nor a comment, without its comment.
    std::string_view content_line() {
        for (;;) {
            const std::string_view text = line();
            const std::string_view content = text.substr(0, text.find('#'));
            if (content.find_first_not_of(" \t") != std::string_view::npos) return content;
        }
    }

    std::string_view bytes(std::size_t count) {
        if (count > rest_.size()) fail("the file is cut off");
        const std::string_view result = rest_.substr(0, count);
        rest_.remove_prefix(count);
        return result;
    }

    template <typename T>
    T number(std::string_view& line, const char* what) {
        const std::string_view word = next_word(line);
        const auto value = to_number<T>(word);
        if (!value)
            fail(std::string("expected ") + what + ", got " +
                 (word.empty() ? "the end of the line" : "'" + std::string(word.substr(0, 40)) + "'"));
        return *value;
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw Error(Errc::InvalidInput, "read_mesh: " + path_ + (line_ > 0 ? ":" + std::to_string(line_) : "") + ": " + what);
    }

private:
    const std::string path_;
    std::string_view rest_;
    std::size_t line_ = 0;
};

/// Collects vertices and polygons, and checks them.
class MeshBuilder {
public:
    explicit MeshBuilder(const Source& source) : source_(source) {}

    void reserve_vertices(std::size_t count) { mesh_.vertices.reserve(count); }
    [[nodiscard]] std::size_t vertex_count() const { return mesh_.vertices.size(); }

    void vertex(double x, double y, double z) {
        const std::array<float, 3> p{float(x), float(y), float(z)};
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
            source_.fail("vertex " + std::to_string(vertex_count()) + ": coordinates that are not finite");
        if (vertex_count() >= std::numeric_limits<std::uint32_t>::max()) source_.fail("more than 2^32 vertices");
        mesh_.vertices.push_back(p);
    }

    /// A fan; pieces with a repeated corner have no area and are left out.
    void polygon(const std::vector<std::uint32_t>& corners) {
        for (std::size_t i = 2; i < corners.size(); ++i)
            if (corners[0] != corners[i - 1] && corners[i - 1] != corners[i] && corners[i] != corners[0])
                mesh_.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }

    /// Faces may come before the vertices that they name, so their numbers are checked here.
    TriangleMesh finish() {
        for (const Face& t : mesh_.triangles)
            for (const std::uint32_t v : t)
                if (v >= vertex_count())
                    source_.fail("a face refers to vertex " + std::to_string(v) + " (from 0), the file has " +
                                 std::to_string(vertex_count()));
        return std::move(mesh_);
    }

private:
    const Source& source_;
    TriangleMesh mesh_;
};

std::uint32_t to_index(const Source& source, double value) {
    if (!(value >= 0 && value < double(std::numeric_limits<std::uint32_t>::max())) || value != std::floor(value))
        source.fail("expected the number of a vertex, got " + std::to_string(value));
    return std::uint32_t(value);
}

// PLY

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

/// STL repeats a vertex in each of its triangles; equal positions become one.
class StlBuilder {
public:
    explicit StlBuilder(const Source& source) : mesh_(source) {}
    void corner(float x, float y, float z) {
        const Key key{std::bit_cast<std::uint32_t>(x + 0.0F), std::bit_cast<std::uint32_t>(y + 0.0F),
                      std::bit_cast<std::uint32_t>(z + 0.0F)};
        const auto [at, is_new] = known_.try_emplace(key, std::uint32_t(mesh_.vertex_count()));
        if (is_new) mesh_.vertex(x, y, z);
        corners_.push_back(at->second);
        if (corners_.size() == 3) {
            mesh_.polygon(corners_);
            corners_.clear();
        }
    }
    TriangleMesh finish() { return mesh_.finish(); }

private:
    using Key = std::array<std::uint32_t, 3>;
    struct Hash {
        std::size_t operator()(const Key& k) const {
            return ((k[0] * 0x9E3779B97F4A7C15ULL ^ k[1]) * 0x9E3779B97F4A7C15ULL ^ k[2]) * 0x9E3779B97F4A7C15ULL;
        }
    };
    MeshBuilder mesh_;
    std::unordered_map<Key, std::uint32_t, Hash> known_;
    std::vector<std::uint32_t> corners_;
};

TriangleMesh read_stl(Source& source, std::string_view text) {
    constexpr std::size_t kHeader = 84, kRecord = 50;
    StlBuilder mesh(source);
    std::uint32_t count = 0;
    if (text.size() >= kHeader) std::memcpy(&count, text.data() + 80, 4);
    const bool exact = text.size() >= kHeader && text.size() == kHeader + kRecord * std::uint64_t(count);
    if (!exact && text.starts_with("solid")) {
        while (!source.at_end()) {
            std::string_view line = source.line();
            if (next_word(line) != "vertex") continue;
            Vec3 p{};
            for (double& c : p) c = source.number<double>(line, "a coordinate");
            mesh.corner(float(p[0]), float(p[1]), float(p[2]));
        }
        return mesh.finish();
    }
    if (text.size() < kHeader + kRecord * std::uint64_t(count) || text.size() < kHeader)
        source.fail("the header promises " + std::to_string(count) + " triangles, the file of " + std::to_string(text.size()) +
                    " bytes is too short");
    source.bytes(kHeader);
    for (std::uint32_t i = 0; i < count; ++i) {
        std::array<float, 12> record{};  // normal, three corners
        std::memcpy(record.data(), source.bytes(kRecord).data(), sizeof(record));
        for (int k = 3; k < 12; k += 3) mesh.corner(record[k], record[k + 1], record[k + 2]);
    }
    return mesh.finish();
}

/// glTF 2.0 in one file: the triangles of all meshes, as their nodes hold them.
class GlbReader {
    static constexpr std::uint64_t kShared = 8;  // times that data may be used

public:
    GlbReader(Source& source, std::string_view text) : source_(source), builder_(source), text_(text) {}

    TriangleMesh read() {
        read_chunks();
        const Json required = member(json_, "extensionsRequired", Json::array());
        if (!required.empty()) unsupported("the extension " + required.dump().substr(0, 60));
        check_nodes();
        for (const Json& mesh : list("meshes"))
            for (const Json& primitive : member(mesh, "primitives", Json::array())) add(primitive);
        return builder_.finish();
    }

private:
    using Json = nlohmann::json;
    struct Accessor {
        std::uint64_t count = 0, stride = 0;
        std::string_view bytes;
        std::uint64_t component = 0;
    };

    [[noreturn]] void unsupported(const std::string& what) const {
        throw Error(Errc::Unsupported, "read_mesh: " + source_.path() + ": " + what + " is not read; export plain triangles without compression, "
                                       "or .ply, .obj or .stl");
    }

    void read_chunks() {
        const auto word = [&](std::string_view bytes) {
            std::uint32_t value = 0;
            std::memcpy(&value, bytes.data(), sizeof(value));
            return value;
        };
        if (source_.bytes(4) != "glTF") source_.fail("expected 'glTF' in the first bytes");
        const std::uint32_t version = word(source_.bytes(4)), total = word(source_.bytes(4));
        if (version != 2) unsupported("version " + std::to_string(version) + " of glTF");
        if (total != text_.size())
            source_.fail("the header promises " + std::to_string(total) + " bytes, the file has " + std::to_string(text_.size()));
        const std::uint32_t json_bytes = word(source_.bytes(4));
        if (source_.bytes(4) != "JSON") source_.fail("expected a chunk of JSON first");
        json_ = Json::parse(source_.bytes(json_bytes), nullptr, false);
        if (!json_.is_object()) source_.fail("its JSON cannot be parsed");
        if (source_.at_end()) return;
        const std::uint32_t binary_bytes = word(source_.bytes(4));
        if (source_.bytes(4) != std::string_view("BIN\0", 4)) source_.fail("expected a binary chunk second");
        binary_ = source_.bytes(binary_bytes);
        unread_ = kShared * binary_.size();
    }

    static Json member(const Json& object, const char* key, Json otherwise) {
        return object.is_object() && object.contains(key) ? object.at(key) : std::move(otherwise);
    }
    const Json& list(const char* key) const {
        static const Json kNone = Json::array();
        return json_.contains(key) && json_.at(key).is_array() ? json_.at(key) : kNone;
    }
    const Json& item(const char* key, const Json& number) const {
        const Json& all = list(key);
        if (!number.is_number_unsigned() || number.get<std::uint64_t>() >= all.size() || !all[number.get<std::uint64_t>()].is_object())
            source_.fail("there is no " + number.dump().substr(0, 40) + " among its " + key);
        return all[number.get<std::uint64_t>()];
    }
    /// A length or a place in the binary chunk: no larger than that, so that sums of a few cannot overflow.
    std::uint64_t size(const Json& object, const char* key, std::uint64_t otherwise) const {
        const Json value = member(object, key, otherwise);
        if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::max<std::uint64_t>(binary_.size(), 1 << 16))
            source_.fail(std::string(key) + ": expected at most the " + std::to_string(binary_.size()) + " bytes there are, got " +
                         value.dump().substr(0, 40));
        return value.get<std::uint64_t>();
    }

    void check_nodes() const {
        for (const Json& node : list("nodes"))
            for (const char* key : {"matrix", "translation", "rotation", "scale"})
                if (node.is_object() && node.contains(key))
                    throw Error(Errc::Unsupported, "read_mesh: " + source_.path() + ": a node with a " + key +
                                                       " is not read; apply the objects' transforms before the export");
    }

    Accessor accessor(const Json& number, const char* type, std::uint64_t components) const {
        const Json& json = item("accessors", number);
        if (json.contains("sparse") || !json.contains("bufferView")) unsupported("an accessor without data of its own");
        if (member(json, "type", nullptr) != type) source_.fail(std::string("expected an accessor of type ") + type);
        const Json& view = item("bufferViews", json.at("bufferView"));
        if (size(view, "buffer", 0) != 0 || item("buffers", 0U).contains("uri")) unsupported("a buffer in another file");
        Accessor result;
        result.component = size(json, "componentType", 0);
        const std::uint64_t width = components * (result.component == 5121 ? 1 : result.component == 5123 ? 2 : 4);
        result.count = size(json, "count", 0);
        result.stride = size(view, "byteStride", width);
        const std::uint64_t begin = size(view, "byteOffset", 0), length = size(view, "byteLength", 0), offset = size(json, "byteOffset", 0);
        if (begin + length > binary_.size() || offset > length || result.stride < width ||
            (result.count > 0 && (length - offset < width || (length - offset - width) / result.stride < result.count - 1)))
            source_.fail("an accessor reaches beyond its data; the file is damaged");
        result.bytes = binary_.substr(begin + offset, length - offset);
        return result;
    }

    /// Meshes may share data; used again and again it would make a small file a large mesh.
    void take(const Accessor& data, std::uint64_t width) {
        if (data.count * width > unread_) source_.fail("its meshes use the same data over and over");
        unread_ -= data.count * width;
    }

    /// @return the number of the accessor's first vertex; primitives may share one
    std::pair<std::uint64_t, std::uint64_t> vertices(const Json& number) {
        const Accessor data = accessor(number, "VEC3", 3);
        if (data.component != 5126) unsupported("positions that are not floats");
        const auto [known, is_new] = first_vertex_.try_emplace(number.get<std::uint64_t>(), builder_.vertex_count());
        if (is_new) {
            take(data, 12);
            for (std::uint64_t n = 0; n < data.count; ++n) {
                std::array<float, 3> p{};
                std::memcpy(p.data(), data.bytes.data() + n * data.stride, sizeof(p));
                builder_.vertex(p[0], p[1], p[2]);
            }
        }
        return {known->second, data.count};
    }

    void add(const Json& primitive) {
        constexpr unsigned kTriangles = 4;
        if (member(primitive, "mode", kTriangles) != kTriangles) unsupported("a mesh that is not of triangles");
        const auto [first, count] = vertices(member(member(primitive, "attributes", nullptr), "POSITION", nullptr));
        std::vector<std::uint32_t> corners;
        const auto corner = [&](std::uint64_t vertex) {
            if (vertex >= count)
                source_.fail("a triangle refers to vertex " + std::to_string(vertex) + " of " + std::to_string(count));
            corners.push_back(std::uint32_t(first + vertex));
            if (corners.size() < 3) return;
            builder_.polygon(corners);
            corners.clear();
        };
        if (!primitive.contains("indices")) {
            for (std::uint64_t n = 0; n < count; ++n) corner(n);
            return;
        }
        const Accessor data = accessor(primitive.at("indices"), "SCALAR", 1);
        const bool is_known = data.component == 5121 || data.component == 5123 || data.component == 5125;
        if (!is_known) source_.fail("expected indices of type 5121, 5123 or 5125, got " + std::to_string(data.component));
        const std::size_t width = data.component == 5121 ? 1 : data.component == 5123 ? 2 : 4;
        take(data, width);
        for (std::uint64_t n = 0; n < data.count; ++n) {
            std::uint32_t vertex = 0;  // the machine is little-endian
            std::memcpy(&vertex, data.bytes.data() + n * data.stride, width);
            corner(vertex);
        }
    }

    Source& source_;
    MeshBuilder builder_;
    std::string_view text_, binary_;
    Json json_;
    std::uint64_t unread_ = 0;
    std::unordered_map<std::uint64_t, std::uint64_t> first_vertex_;
};

// ---------------------------------------------------------------------------------------------------------------- writing

/// A text or binary file that is put together in memory.
class Output {
public:
    Output& operator<<(std::string_view text) {
        data_ += text;
        return *this;
    }
    Output& operator<<(float number) { return append(number); }
    Output& operator<<(std::uint64_t number) { return append(number); }
    template <typename T>
    void raw(const T& value) {
        const auto* bytes = reinterpret_cast<const char*>(&value);
        data_.append(bytes, sizeof(T));
    }
    void pad(std::size_t multiple, char fill) {
        while (data_.size() % multiple != 0) data_ += fill;
    }
    [[nodiscard]] const std::string& data() const { return data_; }

private:
    template <typename T>
    Output& append(T number) {
        std::array<char, 32> text{};
        const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
        data_.append(text.data(), end);
        return *this;
    }
    std::string data_;
};

Output& operator<<(Output& out, const std::array<float, 3>& p) { return out << p[0] << " " << p[1] << " " << p[2]; }

std::vector<std::string> one_line_each(std::vector<std::string> comments) {
    for (std::string& comment : comments)
        std::replace_if(comment.begin(), comment.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
    return comments;
}

/// What every format needs: placed vertices, their normals, one-line comments.
struct Prepared {
    TriangleMesh mesh;
    std::vector<std::array<float, 3>> normals;
    std::vector<std::string> comments;
    std::vector<VertexAttribute> attributes;
    bool binary;
};

void check_references(const TriangleMesh& mesh) {
    for (const Face& t : mesh.triangles)
        for (const std::uint32_t v : t)
            if (v >= mesh.vertices.size())
                throw Error(Errc::InvalidInput, "write_mesh: a triangle refers to vertex " + std::to_string(v) + " of " +
                                                    std::to_string(mesh.vertices.size()));
}

void check_attribute(const VertexAttribute& attribute, const TriangleMesh& mesh) {
    const std::string& name = attribute.name;
    if (name.empty() || std::any_of(name.begin(), name.end(), [](unsigned char c) { return c <= ' '; }))
        throw Error(Errc::InvalidInput, "write_mesh: expected an attribute's name of one word, got '" + name + "'");
    if (attribute.values.size() != mesh.vertices.size())
        throw Error(Errc::InvalidInput, "write_mesh: attribute " + name + ": expected " + std::to_string(mesh.vertices.size()) +
                                            " values, one for each vertex, got " + std::to_string(attribute.values.size()));
}

Prepared prepare(const TriangleMesh& mesh, const WriteMeshOptions& options) {
    if (!(options.unit_scale > 0) || !std::isfinite(options.unit_scale))
        throw Error(Errc::InvalidOptions, "write_mesh: unit_scale: expected > 0, got " + std::to_string(options.unit_scale));
    check_references(mesh);
    for (const VertexAttribute& attribute : options.attributes) check_attribute(attribute, mesh);
    Prepared result{mesh, {}, one_line_each(options.comments), options.attributes, options.binary};
    for (auto& p : result.mesh.vertices) {
        for (float& c : p) c = float(c * options.unit_scale);
        if (options.y_up) p = {p[0], p[2], -p[1]};
    }
    result.normals = vertex_normals(result.mesh);
    return result;
}

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

/// `first` is the number of the mesh's first vertex in the file, from 1.
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

void write_off(Output& out, const Prepared& in) {
    out << "OFF\n";
    for (const std::string& comment : in.comments) out << "# " << comment << "\n";
    out << std::uint64_t(in.mesh.vertices.size()) << " " << std::uint64_t(in.mesh.triangles.size()) << " 0\n";
    for (const auto& p : in.mesh.vertices) out << p << "\n";
    for (const Face& t : in.mesh.triangles)
        out << "3 " << std::uint64_t(t[0]) << " " << std::uint64_t(t[1]) << " " << std::uint64_t(t[2]) << "\n";
}

std::array<float, 3> triangle_normal(const TriangleMesh& mesh, const Face& t) {
    const auto side = [&](int corner, int axis) {
        return double(mesh.vertices[t[corner]][axis]) - mesh.vertices[t[0]][axis];
    };
    Vec3 n{};
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        n[a] = side(1, b) * side(2, c) - side(1, c) * side(2, b);
    }
    const double size = std::hypot(n[0], n[1], n[2]);
    if (!(size > 0)) return {0, 0, 0};
    return {float(n[0] / size), float(n[1] / size), float(n[2] / size)};
}

void write_stl(Output& out, const Prepared& in) {
    if (in.binary) {
        // A header that begins with "solid" would be taken for text.
        std::array<char, 80> header{};
        const std::string text = "covol" + (in.comments.empty() ? std::string() : ": " + in.comments.front());
        std::copy_n(text.begin(), std::min(text.size(), header.size()), header.begin());
        out.raw(header);
        out.raw(std::uint32_t(in.mesh.triangles.size()));
    } else {
        out << "solid covol\n";
    }
    for (const Face& t : in.mesh.triangles) {
        const auto normal = triangle_normal(in.mesh, t);
        if (in.binary) {
            out.raw(normal);
            for (const std::uint32_t v : t) out.raw(in.mesh.vertices[v]);
            out.raw(std::uint16_t(0));
        } else {
            out << "facet normal " << normal << "\n outer loop\n";
            for (const std::uint32_t v : t) out << "  vertex " << in.mesh.vertices[v] << "\n";
            out << " endloop\nendfacet\n";
        }
    }
    if (!in.binary) out << "endsolid covol\n";
}

/// One mesh of a .glb file; without a name it has no material either.
struct GlbPart {
    const Prepared* in;
    const NamedMesh* named;
};

nlohmann::json glb_material(const NamedMesh& named) {
    const auto linear = [](std::uint8_t c) { return std::pow(c / 255.0, 2.2); };  // glTF's factors are linear, not sRGB
    return {{"name", named.name},
            {"pbrMetallicRoughness",
             {{"baseColorFactor", {linear(named.color[0]), linear(named.color[1]), linear(named.color[2]), 1.0}},
              {"metallicFactor", 0.0}}}};
}

/// Describes each mesh in the binary chunk: positions, normals, indices. @returns the chunk's length.
std::uint64_t describe_glb(const std::vector<GlbPart>& parts, nlohmann::json& json) {
    constexpr int kFloat = 5126, kUInt32 = 5125, kVertexData = 34962, kIndexData = 34963;
    std::uint64_t offset = 0;
    const auto add_view = [&](std::uint64_t length, int target) {
        json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}, {"target", target}});
        offset += length;
        return json["bufferViews"].size() - 1;
    };
    for (std::size_t n = 0; n < parts.size(); ++n) {
        const TriangleMesh& mesh = parts[n].in->mesh;
        std::array<float, 3> low{}, high{};
        if (!mesh.vertices.empty()) low = high = mesh.vertices.front();
        for (const auto& p : mesh.vertices)
            for (int a = 0; a < 3; ++a) {
                low[a] = std::min(low[a], p[a]);
                high[a] = std::max(high[a], p[a]);
            }
        const std::uint64_t bytes = 12 * std::uint64_t(mesh.vertices.size());
        nlohmann::json& accessors = json["accessors"];
        const std::size_t first = 3 * n;
        accessors.push_back({{"bufferView", add_view(bytes, kVertexData)}, {"componentType", kFloat},
                             {"count", mesh.vertices.size()}, {"type", "VEC3"}, {"min", low}, {"max", high}});
        accessors.push_back({{"bufferView", add_view(bytes, kVertexData)}, {"componentType", kFloat},
                             {"count", mesh.vertices.size()}, {"type", "VEC3"}});
        accessors.push_back({{"bufferView", add_view(12 * std::uint64_t(mesh.triangles.size()), kIndexData)},
                             {"componentType", kUInt32}, {"count", 3 * mesh.triangles.size()}, {"type", "SCALAR"}});
        nlohmann::json primitive{{"attributes", {{"POSITION", first}, {"NORMAL", first + 1}}}, {"indices", first + 2}};
        nlohmann::json node{{"mesh", n}};
        if (parts[n].named != nullptr) {
            node["name"] = parts[n].named->name;
            primitive["material"] = n;
            json["materials"].push_back(glb_material(*parts[n].named));
        }
        json["meshes"].push_back({{"primitives", nlohmann::json::array({primitive})}});
        json["nodes"].push_back(node);
        json["scenes"][0]["nodes"].push_back(n);
    }
    return offset;
}

/// glTF 2.0 in one file: a JSON chunk that describes the binary chunk.
void write_glb_parts(Output& out, const std::vector<GlbPart>& parts, const std::vector<std::string>& comments) {
    nlohmann::json json{{"asset", {{"version", "2.0"}, {"generator", "covol " COVOL_VERSION}, {"extras", {{"comments", comments}}}}},
                        {"scene", 0}};
    const std::uint64_t binary_bytes = describe_glb(parts, json);
    json["buffers"] = {{{"byteLength", binary_bytes}}};
    Output text;
    text << json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    text.pad(4, ' ');
    const std::uint64_t total = 12 + 8 + text.data().size() + 8 + binary_bytes;
    if (total > std::numeric_limits<std::uint32_t>::max())
        throw Error(Errc::Unsupported, "write_mesh: the mesh is larger than the 4 GB that .glb can hold; write .ply");
    out << "glTF";
    out.raw(std::uint32_t(2));
    out.raw(std::uint32_t(total));
    out.raw(std::uint32_t(text.data().size()));
    out << "JSON" << text.data();
    out.raw(std::uint32_t(binary_bytes));
    out << std::string_view("BIN\0", 4);
    for (const GlbPart& part : parts) {
        for (const auto& p : part.in->mesh.vertices) out.raw(p);
        for (const auto& n : part.in->normals) out.raw(n);
        for (const Face& t : part.in->mesh.triangles) out.raw(t);
    }
}

void write_glb(Output& out, const Prepared& in) { write_glb_parts(out, {{&in, nullptr}}, in.comments); }

using Writer = void (*)(Output&, const Prepared&);

Writer writer_of(const std::string& path) {
    static constexpr struct {
        std::string_view extension;
        Writer writer;
    } kWriters[] = {{".ply", write_ply}, {".obj", write_obj}, {".stl", write_stl}, {".off", write_off}, {".glb", write_glb}};
    const std::string end = detail::extension(path);
    for (const auto& known : kWriters)
        if (known.extension == end) return known.writer;
    throw Error(Errc::InvalidOptions,
                "write_mesh: " + path + ": expected a name that ends in .ply, .obj, .stl, .off or .glb, got '" + end + "'");
}

void save(const std::string& path, const Output& out) {
    detail::write_atomically(path, [&](const std::string& temporary) {
        std::ofstream file(temporary, std::ios::binary);
        if (!file.write(out.data().data(), std::streamsize(out.data().size())) || !file.flush())
            throw Error(Errc::Io, "write_mesh: " + path + ": cannot be written");
    });
}

}  // namespace

void check_mesh_extension(const std::string& path) { static_cast<void>(writer_of(path)); }

void write_mesh(const std::string& path, const TriangleMesh& mesh, const WriteMeshOptions& options) {
    const Writer writer = writer_of(path);
    Output out;
    writer(out, prepare(mesh, options));
    save(path, out);
}

bool holds_several_meshes(const std::string& path) {
    const std::string end = detail::extension(path);
    return end == ".obj" || end == ".glb";
}

void write_meshes(const std::string& path, const std::vector<NamedMesh>& meshes, const WriteMeshOptions& options) {
    if (!holds_several_meshes(path))
        throw Error(Errc::InvalidOptions, "write_meshes: " + path + ": expected a name that ends in .obj or .glb");
    if (meshes.empty()) throw Error(Errc::InvalidInput, "write_meshes: " + path + ": expected a mesh, got none");
    WriteMeshOptions bare = options;
    bare.attributes.clear();
    std::vector<Prepared> prepared;
    for (const NamedMesh& named : meshes) prepared.push_back(prepare(named.mesh, bare));
    const std::vector<std::string>& comments = prepared.front().comments;
    Output out;
    if (detail::extension(path) == ".glb") {
        std::vector<GlbPart> parts;
        for (std::size_t n = 0; n < meshes.size(); ++n) parts.push_back({&prepared[n], &meshes[n]});
        write_glb_parts(out, parts, comments);
    } else {
        for (const std::string& comment : comments) out << "# " << comment << "\n";
        std::uint64_t first = 1;
        for (std::size_t n = 0; n < meshes.size(); ++n) {
            out << "o " << one_line_each({meshes[n].name}).front() << "\n";
            write_obj_object(out, prepared[n], first);
            first += prepared[n].mesh.vertices.size();
        }
    }
    save(path, out);
}

bool is_mesh_name(const std::string& path) {
    const std::string end = detail::extension(path);
    return end == ".ply" || end == ".obj" || end == ".stl" || end == ".off" || end == ".glb";
}

TriangleMesh read_mesh(const std::string& path) {
    const std::string end = detail::extension(path);
    if (!is_mesh_name(path))
        throw Error(Errc::Unsupported, "read_mesh: " + path + ": expected a name that ends in .ply, .obj, .stl, .off or .glb, got '" + end + "'");
    const std::string text = read_file(path);
    Source source(path, text);
    TriangleMesh mesh = end == ".ply"   ? PlyReader(source).read()
                        : end == ".obj" ? read_obj(source)
                        : end == ".stl" ? read_stl(source, text)
                        : end == ".glb" ? GlbReader(source, text).read()
                                        : read_off(source);
    if (mesh.empty()) throw Error(Errc::InvalidInput, "read_mesh: " + path + ": the file has no triangle");
    return mesh;
}

}  // namespace covol
