#include "covol/report_page.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/geometry.h"
#include "covol/error.h"
#include "covol/safe_text.h"
#include "covol/version.h"
#include "files/atomic.h"
#include "report/cluster.h"
#include "report/encoding.h"
#include "report/mesh_codec.h"
#include "report/page_slices.h"
#include "report/viewer.h"

namespace covol {
namespace {

using Json = nlohmann::ordered_json;
using detail::pack;

Json to_json(const Vec3& v) { return Json::array({v[0], v[1], v[2]}); }

// All positions of the page are relative to the origin of the first mesh. Browsers compute in single precision, which
// is too coarse for coordinates far from 0.
Vec3 origin_of(const ReportPage& page) { return page.structures.front().mesh->origin; }

std::string packed_marks(const std::vector<Vec3>& marks, const Vec3& origin, std::int64_t maximum) {
    const std::size_t stride = marks.size() / std::size_t(maximum + 1) + 1;
    std::vector<float> numbers;
    for (std::size_t n = 0; n < marks.size(); n += stride)
        for (int a = 0; a < 3; ++a) numbers.push_back(float(marks[n][a] - origin[a]));
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(numbers.data());
    return pack({bytes, bytes + numbers.size() * sizeof(float)});
}

Json to_json(const Evidence& evidence, const Vec3& origin) {
    Json suggestions = Json::array();
    for (const Suggestion& s : evidence.suggestions)
        suggestions.push_back({{"slice", s.slice},
                               {"area", s.area},
                               {"index", to_json(s.index)},
                               {"world", to_json(minus(s.world, origin))}});
    return {{"reach", evidence.reach},
            {"weak_edge", evidence.weak_edge},
            {"area", evidence.area},
            {"unsupported_area", evidence.unsupported_area},
            {"suggestions", suggestions}};
}

detail::PageMesh page_mesh(const PageStructure& structure, const Vec3& origin, std::int64_t maximum) {
    detail::PageMesh mesh{*structure.mesh, {}};
    move_mesh_origin(mesh.mesh, origin);
    const auto add = [&](const char* name, const std::vector<float>& values) {
        if (values.size() == mesh.mesh.vertices.size()) mesh.values.emplace_back(name, values);
    };
    if (structure.evidence != nullptr) {
        add("distance_to_marks", structure.evidence->distance_to_marks);
        add("edge_strength", structure.evidence->edge_strength);
    }
    return cluster(std::move(mesh), maximum);
}

Json to_json(const PageStructure& structure, const Vec3& origin, const ReportPageOptions& options,
             std::int64_t max_triangles, ReportPageSummary& summary) {
    const detail::PageMesh shown = page_mesh(structure, origin, max_triangles);
    const detail::CodedMesh coded = detail::encode(shown.mesh);
    summary.triangles += coded.triangle_count;
    Json values = Json::object();
    for (const auto& [name, numbers] : shown.values) {
        const detail::CodedValues own = detail::encode(numbers, coded.from);
        values[name] = {{"min", own.min}, {"max", own.max}, {"data", pack(own.steps)}};
    }
    Json json{
        {"name", safe_text(structure.name)},
        {"color", structure.color},
        {"mesh",
         {{"vertices", coded.vertex_count},
          {"triangles", coded.triangle_count},
          {"of_triangles", structure.mesh->triangles.size()},
          {"min", coded.min},
          {"max", coded.max},
          {"positions", pack(coded.positions)},
          {"corners", pack(coded.corners)},
          {"values", values}}},
        {"marks",
         {{"count", structure.marks.size()}, {"data", packed_marks(structure.marks, origin, options.max_marks)}}}};
    if (structure.evidence != nullptr) json["evidence"] = to_json(*structure.evidence, origin);
    return json;
}

/// The corners of the box that the slices have to show.
std::vector<Vec3> places_of(const ReportPage& page) {
    WorldBox box;
    box.min.fill(std::numeric_limits<double>::max());
    box.max.fill(std::numeric_limits<double>::lowest());
    const auto add = [&](const auto& place) {
        for (int a = 0; a < 3; ++a) {
            box.min[a] = std::min(box.min[a], double(place[a]));
            box.max[a] = std::max(box.max[a], double(place[a]));
        }
    };
    for (const PageStructure& structure : page.structures) {
        for (std::size_t v = 0; v < structure.mesh->vertices.size(); ++v) add(structure.mesh->place(v));
        for (const Vec3& mark : structure.marks) add(mark);
    }
    const std::array<Vec3, 8> corners = covol::corners(box);
    return {corners.begin(), corners.end()};
}

Json to_json(const Image& image, const detail::SlicePlan& plan, const Vec3& origin, const ReportPageOptions& options,
             const RunContext& run) {
    const detail::CodedSlices coded = encode_slices(image, plan, options.jpeg_quality, run);
    const ImageGeometry &g = coded.geometry, &whole = image.geometry();
    return {{"size", g.size},
            {"spacing", to_json(g.spacing)},
            {"origin", to_json(minus(g.origin, origin))},
            {"direction", {to_json(g.direction[0]), to_json(g.direction[1]), to_json(g.direction[2])}},
            {"first", plan.region.min},
            {"step", plan.step},
            {"of_size", whole.size},
            {"of_spacing", to_json(whole.spacing)},
            {"of_origin", to_json(minus(whole.origin, origin))},
            {"black", coded.black},
            {"white", coded.white},
            {"slices", coded.jpegs}};
}

void check(const ReportPage& page, const ReportPageOptions& options) {
    require_valid(options, "write_report_page");
    if (page.structures.empty()) throw Error(Errc::InvalidInput, "structures: expected at least one, got none");
    if (!page.frames.empty() && page.frame >= page.frames.size())
        throw Error(Errc::InvalidInput, "frame: expected less than " + std::to_string(page.frames.size()) +
                                            ", the number of frames, got " + std::to_string(page.frame));
    for (const PageStructure& structure : page.structures)
        if (structure.mesh == nullptr || structure.mesh->empty())
            throw Error(Errc::InvalidInput, structure.name + ": expected a mesh with triangles, got none");
}

Json data_of(const ReportPage& page, const ReportPageOptions& options, ReportPageSummary& summary,
             const RunContext& run) {
    Json facts = Json::parse(page.facts, nullptr, false);
    if (!facts.is_object()) throw Error(Errc::InvalidInput, "facts: expected a JSON object, got something else");
    Json data{{"covol", version()},
              {"title", safe_text(page.title)},
              {"unit", safe_text(page.unit)},
              {"anatomical", page.is_anatomical},
              {"origin", to_json(origin_of(page))},
              {"facts", std::move(facts)},
              {"structures", Json::array()}};
    if (page.frames.size() > 1) {
        Json names = Json::array();
        for (const std::string& name : page.frames) names.push_back(safe_text(name));
        data["frames"] = {{"at", page.frame}, {"pages", std::move(names)}};
    }
    double all = 0;
    for (const PageStructure& structure : page.structures) all += double(structure.mesh->triangles.size());
    for (const PageStructure& structure : page.structures) {
        run.check();
        const double fraction = double(structure.mesh->triangles.size()) / all;
        const auto maximum = std::max<std::int64_t>(100, std::int64_t(fraction * double(options.max_triangles)));
        data["structures"].push_back(to_json(structure, origin_of(page), options, maximum, summary));
    }
    if (page.image == nullptr) return data;
    const detail::SlicePlan plan =
        detail::plan_slices(page.image->geometry(), page.image->held(), places_of(page), options.max_voxels);
    try {
        data["image"] = to_json(*page.image, plan, origin_of(page), options, run);
        summary.slices_size = plan.size;
        summary.slices_step = plan.step;
    } catch (const Error& error) {
        if (error.code() != Errc::InvalidOptions) throw;  // the image's chunks need more memory than is allowed
        run.warn(std::string("the report page has no slices: ") + error.what());
    }
    return data;
}

}  // namespace

ReportPageSummary write_report_page(const std::string& path, const ReportPage& page, const ReportPageOptions& options,
                                    const RunContext& run) {
    check(page, options);
    ReportPageSummary summary;
    std::string data;
    with_threads(
        run, [&] { data = data_of(page, options, summary, run).dump(-1, ' ', true, Json::error_handler_t::replace); });
    data = detail::safe_in_script(data);
    const std::string_view viewer = detail::viewer();
    constexpr std::string_view kTitle = "{{title}}", kData = "{{data}}";
    const std::size_t title = viewer.find(kTitle), script = viewer.find(kData);
    const std::string safe_title = detail::escape_html(safe_text(page.title));
    detail::write_atomically(path, [&](const std::string& temporary) {
        std::ofstream file(temporary, std::ios::binary);
        file << viewer.substr(0, title) << safe_title
             << viewer.substr(title + kTitle.size(), script - title - kTitle.size()) << data
             << viewer.substr(script + kData.size());
        summary.bytes = std::uint64_t(std::max<std::streamoff>(0, file.tellp()));
        file.close();
        if (!file) throw Error(Errc::Io, path + ": cannot write");
    });
    return summary;
}

}  // namespace covol
