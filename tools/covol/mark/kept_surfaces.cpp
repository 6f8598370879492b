#include "mark/kept_surfaces.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include "covol/digest.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "mark/mark_json.h"

namespace covol::tool {
namespace {

constexpr int kVersion = 1;
constexpr const char* kSurfaces = "surfaces";  // name of the folder of surfaces, in that of the study
constexpr std::size_t kMaxHeadBytes = std::size_t(1) << 20;
constexpr std::uintmax_t kMaxBytes = std::uintmax_t(1) << 30;
static_assert(std::endian::native == std::endian::little);

/// Digest of everything that the surface of a structure depends on; it does not include names, colours and locks.
std::string made_from(const StudyStructure& structure, const StudyOptions& options, const std::string& of) {
    Json json{{"of", of}, {"marks", Json::array()}, {"outlines", Json::array()}, {"strokes", Json::array()}};
    for (const StudyMark& m : structure.marks) json["marks"].push_back({int(m.kind), m.world});
    for (const StudyOutline& o : structure.outlines) json["outlines"].push_back({o.axis, o.at, o.closed, o.world});
    for (const StudyStroke& s : structure.strokes)
        json["strokes"].push_back({s.erases, s.radius, s.axis.value_or(-1), s.at, s.world});
    if (structure.guess) json["guess"] = {structure.guess->path, structure.guess->digest, structure.guess->label};
    json["options"] = options_json(options);
    return digest_of_bytes(text_of(json));
}

bool is_finite(const Json& json) { return json.is_number() && std::isfinite(json.get<double>()); }

/// The validated KeptSurfaces::Kept::figures of a file. @throws Error InvalidInput; Json::exception
Json checked_figures(const Json& from) {
    const auto require = [](bool is_good) {
        if (!is_good) throw Error(Errc::InvalidInput, "kept surface: damaged");
    };
    Json figures;
    for (const char* name : {"triangles", "volume", "area", "seconds"}) {
        require(is_finite(from.at(name)));
        figures[name] = from.at(name);
    }
    require(from.at("extent").is_array() && from.at("extent").size() == 3 &&
            std::all_of(from.at("extent").begin(), from.at("extent").end(), is_finite));
    figures["extent"] = from.at("extent");
    for (const char* name : {"mean", "sd"}) {
        require(from.at(name).is_null() || is_finite(from.at(name)));
        figures[name] = from.at(name);
    }
    figures["expected"] = nullptr;
    if (const Json& expected = from.at("expected"); !expected.is_null())
        for (const char* name : {"value", "low", "high"}) {
            require(is_finite(expected.at(name)));
            figures["expected"][name] = expected.at(name);
        }
    figures["warnings"] = Json::array();
    for (const Json& warning : from.at("warnings")) figures["warnings"].push_back(warning.get<std::string>());
    return figures;
}

template <typename Element>
void append(std::string& text, const std::vector<Element>& list) {
    text.append(reinterpret_cast<const char*>(list.data()), list.size() * sizeof(Element));
}

template <typename Element>
const char* take(std::vector<Element>& list, const char* from) {
    std::memcpy(list.data(), from, list.size() * sizeof(Element));
    return from + list.size() * sizeof(Element);
}

/// The mesh after a file's header. The content is not trusted, and is validated.
TriangleMesh parse_mesh(const Json& head, std::string_view bytes) {
    using Vertex = decltype(TriangleMesh::vertices)::value_type;
    using Triangle = decltype(TriangleMesh::triangles)::value_type;
    const auto vertices = head.at("vertices").get<std::uint64_t>(), triangles = head.at("corners").get<std::uint64_t>();
    if (vertices > bytes.size() || triangles > bytes.size() ||
        vertices * sizeof(Vertex) + triangles * sizeof(Triangle) != bytes.size())
        throw Error(Errc::InvalidInput, "kept surface: its size is not that of the mesh");
    TriangleMesh mesh;
    mesh.origin = head.at("origin").get<Vec3>();
    mesh.vertices.resize(vertices);
    mesh.triangles.resize(triangles);
    (void)take(mesh.triangles, take(mesh.vertices, bytes.data()));
    const auto is_place = [](const Vertex& v) { return std::isfinite(v[0] + v[1] + v[2]); };
    const auto is_there = [&](const Triangle& t) { return *std::max_element(t.begin(), t.end()) < vertices; };
    if (!std::all_of(mesh.vertices.begin(), mesh.vertices.end(), is_place) ||
        !std::all_of(mesh.triangles.begin(), mesh.triangles.end(), is_there))
        throw Error(Errc::InvalidInput, "kept surface: damaged");
    return mesh;
}

}  // namespace

KeptSurfaces::KeptSurfaces(const std::string& folder, std::string of)
    : folder_((std::filesystem::path(folder) / kSurfaces).string()), of_(std::move(of)) {}

std::string KeptSurfaces::path_of(StudyId structure) const {
    return (std::filesystem::path(folder_) / (std::to_string(structure) + ".surface")).string();
}

std::optional<KeptSurfaces::Kept> KeptSurfaces::find(const StudyStructure& structure,
                                                     const StudyOptions& options) const {
    const std::string path = path_of(structure.id);
    std::error_code none;
    const std::uintmax_t bytes = std::filesystem::file_size(path, none);
    if (none || bytes > kMaxBytes) return std::nullopt;
    std::ifstream file = open_regular_file(path);
    std::string text(std::size_t(bytes), '\0');
    if (!file.read(text.data(), std::streamsize(bytes))) return std::nullopt;
    try {
        const std::size_t end = std::string_view(text).substr(0, kMaxHeadBytes).find('\n');
        if (end == std::string::npos) return std::nullopt;
        const Json head = Json::parse(text.begin(), text.begin() + std::ptrdiff_t(end));
        if (head.at("covol_surface") != kVersion || head.at("of") != made_from(structure, options, of_))
            return std::nullopt;
        return Kept{checked_figures(head.at("figures")),
                    std::make_shared<const TriangleMesh>(parse_mesh(head, std::string_view(text).substr(end + 1)))};
    } catch (const Json::exception&) {
        return std::nullopt;
    } catch (const Error&) {
        return std::nullopt;
    }
}

void KeptSurfaces::keep(const StudyStructure& structure, const StudyOptions& options, const Json& result,
                        const TriangleMesh& mesh) const {
    const Json head{{"covol_surface", kVersion},          {"of", made_from(structure, options, of_)},
                    {"figures", checked_figures(result)}, {"vertices", mesh.vertices.size()},
                    {"corners", mesh.triangles.size()},   {"origin", mesh.origin}};
    std::string text = text_of(head) + '\n';
    append(text, mesh.vertices);
    append(text, mesh.triangles);
    std::error_code failed;
    std::filesystem::create_directories(folder_, failed);
    if (failed) return;
    try {
        write_text_file(path_of(structure.id), text);
    } catch (const Error&) {
        return;
    }
}

}  // namespace covol::tool
