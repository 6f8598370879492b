// Reads and writes the binary form of glTF 2.0 (.glb), in which one file holds the JSON description and the data.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "covol/error.h"
#include "covol/version.h"
#include "io/mesh/mesh_formats.h"
#include "mesh/missing_vertex.h"

namespace covol::mesh_io {
namespace {

/// Reads the triangles of all meshes of a .glb file, and translates them as their nodes state.
class GlbReader {
    // Maximum number of bytes that accessors read in total, as a multiple of the size of the binary chunk.
    static constexpr std::uint64_t kMaxReuse = 8;

public:
    GlbReader(Source& source, std::string_view text) : source_(source), builder_(source), text_(text) {}

    TriangleMesh read() {
        read_chunks();
        const Json required = member(json_, "extensionsRequired", Json::array());
        if (!required.empty()) unsupported("the extension " + required.dump().substr(0, 60));
        const std::vector<Vec3> translations = read_nodes();
        for (std::size_t n = 0; n < translations.size(); ++n) {
            if (translations[n] != translation_) first_vertex_.clear();  // the known vertices have another translation
            translation_ = translations[n];
            for (const Json& primitive : member(list("meshes")[n], "primitives", Json::array())) add(primitive);
        }
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
        source_.unsupported(what + " is not read; export plain triangles without compression, or .ply, .obj or .stl");
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
            source_.fail("the header promises " + std::to_string(total) + " bytes, but the file has " +
                         std::to_string(text_.size()));
        const std::uint32_t json_bytes = word(source_.bytes(4));
        if (source_.bytes(4) != "JSON") source_.fail("expected a chunk of JSON first");
        json_ = Json::parse(source_.bytes(json_bytes), nullptr, false);
        if (!json_.is_object()) source_.fail("its JSON cannot be parsed");
        if (source_.at_end()) return;
        const std::uint32_t binary_bytes = word(source_.bytes(4));
        if (source_.bytes(4) != std::string_view("BIN\0", 4)) source_.fail("expected a binary chunk second");
        binary_ = source_.bytes(binary_bytes);
        unread_ = kMaxReuse * binary_.size();
    }

    static Json member(const Json& object, const char* key, const Json& otherwise) {
        return object.is_object() && object.contains(key) ? object.at(key) : otherwise;
    }
    const Json& list(const char* key) const {
        static const Json kNone = Json::array();
        return json_.contains(key) && json_.at(key).is_array() ? json_.at(key) : kNone;
    }
    const Json& item(const char* key, const Json& number) const {
        const Json& all = list(key);
        if (!number.is_number_unsigned() || number.get<std::uint64_t>() >= all.size() ||
            !all[number.get<std::uint64_t>()].is_object())
            source_.fail("expected the number of one of its " + std::to_string(all.size()) + " " + key +
                         ", from 0, got " + number.dump().substr(0, 40));
        return all[number.get<std::uint64_t>()];
    }
    /// An integer of a JSON object: a length, a position or a code; `otherwise` if the object does not have the key.
    /// Integers above both the size of the binary chunk and 65536 are refused, so that sums of a few of these numbers
    /// cannot overflow.
    std::uint64_t size(const Json& object, const char* key, std::uint64_t otherwise) const {
        const Json value = member(object, key, otherwise);
        const std::uint64_t maximum = std::max<std::uint64_t>(binary_.size(), 1 << 16);
        if (!value.is_number_unsigned() || value.get<std::uint64_t>() > maximum)
            source_.fail(std::string(key) + ": expected a whole number up to " + std::to_string(maximum) + ", got " +
                         value.dump().substr(0, 40));
        return value.get<std::uint64_t>();
    }

    /// The translation of each mesh by its node; 0 for meshes without a node. Files with coordinates far from 0 use
    /// translations, because glTF stores positions in single precision. @throws Error Unsupported if two nodes
    /// translate a mesh differently, or if a node rotates or scales.
    [[nodiscard]] std::vector<Vec3> read_nodes() const {
        std::vector<Vec3> translations(list("meshes").size(), Vec3{0, 0, 0});
        std::vector<bool> is_placed(translations.size(), false);
        const auto refuse = [&](const std::string& what) {
            source_.unsupported("a node with " + what +
                                " is not read; apply the objects' transforms before the export");
        };
        for (const Json& node : list("nodes")) {
            if (!node.is_object()) continue;
            for (const char* key : {"matrix", "rotation", "scale"})
                if (node.contains(key)) refuse(std::string("a ") + key);
            Vec3 moved{0, 0, 0};
            if (node.contains("translation")) {
                const Json& json = node.at("translation");
                const auto is_number = [](const Json& c) { return c.is_number(); };
                if (!json.is_array() || json.size() != 3 || !std::all_of(json.begin(), json.end(), is_number))
                    source_.fail("translation: expected three numbers, got " + json.dump().substr(0, 40));
                if (node.contains("children")) refuse("a translation and children");
                for (std::size_t a = 0; a < 3; ++a) moved[a] = json[a].get<double>();
            }
            if (!node.contains("mesh")) continue;
            static_cast<void>(item("meshes", node.at("mesh")));
            const auto n = node.at("mesh").get<std::size_t>();
            if (is_placed[n] && translations[n] != moved) refuse("a mesh that another node places elsewhere");
            is_placed[n] = true;
            translations[n] = moved;
        }
        return translations;
    }

    Accessor accessor(const Json& number, const char* type, std::uint64_t components) const {
        const Json& json = item("accessors", number);
        if (json.contains("sparse") || !json.contains("bufferView")) unsupported("an accessor without data of its own");
        if (member(json, "type", nullptr) != type) source_.fail(std::string("expected an accessor of type ") + type);
        const Json& view = item("bufferViews", json.at("bufferView"));
        if (size(view, "buffer", 0) != 0 || item("buffers", 0U).contains("uri"))
            unsupported("a buffer in another file");
        Accessor result;
        result.component = size(json, "componentType", 0);
        const std::uint64_t width = components * (result.component == 5121 ? 1 : result.component == 5123 ? 2 : 4);
        result.count = size(json, "count", 0);
        result.stride = size(view, "byteStride", width);
        const std::uint64_t begin = size(view, "byteOffset", 0), length = size(view, "byteLength", 0),
                            offset = size(json, "byteOffset", 0);
        if (begin + length > binary_.size() || offset > length || result.stride < width ||
            (result.count > 0 &&
             (length - offset < width || (length - offset - width) / result.stride < result.count - 1)))
            source_.fail("an accessor reaches beyond its data; the file is damaged");
        result.bytes = binary_.substr(begin + offset, length - offset);
        return result;
    }

    /// Counts the bytes that are read. Meshes may use the same data repeatedly, but the sum is limited to kMaxReuse
    /// times the size of the binary chunk, because a small file could otherwise yield a huge mesh.
    void take(const Accessor& data, std::uint64_t width) {
        if (data.count * width > unread_) source_.fail("its meshes use the same data too often");
        unread_ -= data.count * width;
    }

    /// Reads the vertices of an accessor unless they were read before: primitives may use the same accessor.
    /// @return the index of the first vertex, and the number of vertices
    std::pair<std::uint64_t, std::uint64_t> vertices(const Json& number) {
        const Accessor data = accessor(number, "VEC3", 3);
        if (data.component != 5126) unsupported("a mesh whose positions are not floats");
        const auto [known, is_new] = first_vertex_.try_emplace(number.get<std::uint64_t>(), builder_.vertex_count());
        if (is_new) {
            take(data, 12);
            for (std::uint64_t n = 0; n < data.count; ++n) {
                std::array<float, 3> p{};
                std::memcpy(p.data(), data.bytes.data() + n * data.stride, sizeof(p));
                const Vec3 at{translation_[0] + p[0], translation_[1] + p[1], translation_[2] + p[2]};
                builder_.vertex({at[0], -at[2], at[1]});  // in glTF, y points up; in a TriangleMesh, z does
            }
        }
        return {known->second, data.count};
    }

    void add(const Json& primitive) {
        constexpr unsigned kTriangles = 4;
        if (member(primitive, "mode", kTriangles) != kTriangles) unsupported("a mesh that is not of triangles");
        const auto placed = vertices(member(member(primitive, "attributes", nullptr), "POSITION", nullptr));
        const std::uint64_t first = placed.first, count = placed.second;
        std::vector<std::uint32_t> corners;
        const auto corner = [&](std::uint64_t vertex) {
            if (vertex >= count) source_.fail("a triangle " + detail::refers_to_missing(vertex, count));
            corners.push_back(std::uint32_t(first + vertex));
            if (corners.size() < 3) return;
            builder_.face(corners);
            corners.clear();
        };
        if (!primitive.contains("indices")) {
            for (std::uint64_t n = 0; n < count; ++n) corner(n);
            return;
        }
        const Accessor data = accessor(primitive.at("indices"), "SCALAR", 1);
        const bool is_known = data.component == 5121 || data.component == 5123 || data.component == 5125;
        if (!is_known)
            source_.fail("expected indices of type 5121, 5123 or 5125, got " + std::to_string(data.component));
        const std::size_t width = data.component == 5121 ? 1 : data.component == 5123 ? 2 : 4;
        take(data, width);
        for (std::uint64_t n = 0; n < data.count; ++n) {
            // Indices of 8 or 16 bits are copied to the low bytes of `vertex`, because the machine is little-endian.
            std::uint32_t vertex = 0;
            std::memcpy(&vertex, data.bytes.data() + n * data.stride, width);
            corner(vertex);
        }
    }

    Source& source_;
    MeshBuilder builder_;
    std::string_view text_, binary_;
    Json json_;
    std::uint64_t unread_ = 0;
    Vec3 translation_{0, 0, 0};  ///< translation of the current mesh
    std::unordered_map<std::uint64_t, std::uint64_t> first_vertex_;
};

nlohmann::json glb_material(const NamedMesh& named) {
    const auto linear = [](std::uint8_t c) {
        return std::pow(c / 255.0, 2.2);
    };  // glTF's colour factors are linear, not sRGB
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
        json["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}, {"target", target}});
        offset += length;
        return json["bufferViews"].size() - 1;
    };
    for (std::size_t n = 0; n < parts.size(); ++n) {
        const Prepared& mesh = *parts[n].in;
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
        accessors.push_back({{"bufferView", add_view(bytes, kVertexData)},
                             {"componentType", kFloat},
                             {"count", mesh.vertices.size()},
                             {"type", "VEC3"},
                             {"min", low},
                             {"max", high}});
        accessors.push_back({{"bufferView", add_view(bytes, kVertexData)},
                             {"componentType", kFloat},
                             {"count", mesh.vertices.size()},
                             {"type", "VEC3"}});
        accessors.push_back({{"bufferView", add_view(12 * std::uint64_t(mesh.triangles.size()), kIndexData)},
                             {"componentType", kUInt32},
                             {"count", 3 * mesh.triangles.size()},
                             {"type", "SCALAR"}});
        nlohmann::json primitive{{"attributes", {{"POSITION", first}, {"NORMAL", first + 1}}}, {"indices", first + 2}};
        nlohmann::json node{{"mesh", n}};
        if (mesh.places.is_far()) node["translation"] = mesh.places.origin();
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

}  // namespace

TriangleMesh read_glb(Source& source, std::string_view text) { return GlbReader(source, text).read(); }

void write_glb_parts(Output& out, const std::vector<GlbPart>& parts, const std::vector<std::string>& comments) {
    nlohmann::json json{
        {"asset",
         {{"version", "2.0"}, {"generator", "covol " COVOL_VERSION_STRING}, {"extras", {{"comments", comments}}}}},
        {"scene", 0}};
    const std::uint64_t binary_bytes = describe_glb(parts, json);
    json["buffers"] = {{{"byteLength", binary_bytes}}};
    Output text;
    text << json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    text.pad(4, ' ');
    const std::uint64_t total = 12 + 8 + text.data().size() + 8 + binary_bytes;
    if (total > std::numeric_limits<std::uint32_t>::max())
        throw Error(Errc::Unsupported, "the mesh is larger than the 4 GB that .glb can hold; write .ply");
    out << "glTF";
    out.raw(std::uint32_t(2));
    out.raw(std::uint32_t(total));
    out.raw(std::uint32_t(text.data().size()));
    out << "JSON" << text.data();
    out.raw(std::uint32_t(binary_bytes));
    out << std::string_view("BIN\0", 4);
    for (const GlbPart& part : parts) {
        for (const auto& p : part.in->vertices) out.raw(p);
        for (const auto& n : part.in->normals) out.raw(n);
        for (const Face& t : part.in->triangles) out.raw(t);
    }
}

void write_glb(Output& out, const Prepared& in) { write_glb_parts(out, {{&in, nullptr}}, in.comments); }

}  // namespace covol::mesh_io
