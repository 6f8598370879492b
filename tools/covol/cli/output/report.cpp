#include "cli/output/report.h"

#include <iomanip>
#include <sstream>

namespace covol::tool {

Json to_json(const Vec3& v) { return Json::array({v[0], v[1], v[2]}); }

Json to_json(const WorldBox& box) { return {{"min", to_json(box.min)}, {"max", to_json(box.max)}}; }

Json to_json(const ImageGeometry& g) {
    return {{"size", {g.size[0], g.size[1], g.size[2]}},
            {"spacing", to_json(g.spacing)},
            {"origin", to_json(g.origin)},
            {"direction", {to_json(g.direction[0]), to_json(g.direction[1]), to_json(g.direction[2])}},
            {"unit", g.unit}};
}

Json to_json(const ChunkCount& c) { return {{"size", c.size}, {"read", c.read}, {"of", c.total}}; }

Json to_json(const Domain& d) {
    return {{"voxel_size", d.voxel_size},
            {"origin", to_json(d.origin)},
            {"min", {d.min[0], d.min[1], d.min[2]}},
            {"max", {d.max[0], d.max[1], d.max[2]}},
            {"world", to_json(d.world_box())}};
}

Json to_json(const BandReport& r) {
    return {{"tag_distance", r.tag_distance},         {"enclosed_volume", r.enclosed_volume},
            {"core_volume", r.core_volume},           {"leaks", r.leaks},
            {"holding_distance", r.holding_distance}, {"active_voxels", r.active_voxels}};
}

Json to_json(const EdgeReport& r) {
    return {
        {"sigma", r.sigma}, {"edge_k", r.edge_k}, {"edge_contrast", r.edge_contrast}, {"low", r.low}, {"high", r.high}};
}

Json to_json(const EvolveReport& r) {
    return {{"steps", r.steps},
            {"stop_reason", to_string(r.stop_reason)},
            {"last_change", r.last_change},
            {"sweeps_per_step", r.sweeps_per_step},
            {"leaf_visits", r.leaf_visits},
            {"leaf_visits_saved", r.leaf_visits_saved},
            {"seconds_assembly", r.seconds_assembly},
            {"seconds_sweeps", r.seconds_sweeps}};
}

Json to_json(const SegmentReport::CoarseLevel& level) {
    Json json{{"voxel_size", level.voxel_size}, {"steps", level.steps}, {"active_voxels", level.active_voxels}};
    if (!level.why_not.empty()) json["left_out"] = level.why_not;
    return json;
}

Json to_json(const MeshMeasures& m) {
    return {{"volume", m.volume}, {"area", m.area},     {"components", m.components},
            {"genus", m.genus},   {"closed", m.closed}, {"manifold", m.manifold}};
}

Json to_json(const MeshDeviation& d) { return {{"mean", d.mean}, {"max", d.max}}; }

Json to_json(const RelaxReport& r) {
    return {
        {"triangles", r.triangles}, {"smallest_angle", r.smallest_angle}, {"deviation_voxels", to_json(r.deviation)}};
}

Json to_json(const FitStatistics& f) { return {{"mean", f.mean}, {"p95", f.p95}, {"max", f.max}}; }

Json to_json(const SeedCheck& s) {
    Json json{{"inside", s.inside},
              {"outside", s.outside},
              {"wrong", s.wrong()},
              {"wrong_inside", s.wrong_inside},
              {"wrong_outside", s.wrong_outside}};
    if (s.wrong() > 0) json["first_wrong"] = to_json(s.first);
    return json;
}

Json to_json(const CompareReport& r) {
    return {{"dice", r.dice},           {"jaccard", r.jaccard},  {"volume_a", r.volume_a}, {"volume_b", r.volume_b},
            {"hausdorff", r.hausdorff}, {"hausdorff95", r.hd95}, {"mean_distance", r.assd}};
}

/// An empty optional, and an enumerator called "auto", become null. Either the run did not need the option, or the step
/// that uses it chooses the value itself.
template <typename T>
static Json to_json_value(const T& value) {
    if constexpr (requires { *value, value.has_value(); })
        return value ? to_json_value(*value) : Json(nullptr);
    else if constexpr (HasWords<T>)
        return to_string(value) == std::string_view("auto") ? Json(nullptr) : Json(to_string(value));
    else if constexpr (requires { to_json(value); })
        return to_json(value);
    else
        return value;
}

Json to_json(const SegmentOptions& o) {
    Json json;
    for_each_option(o, [&](const OptionInfo& option, const auto& value) {
        const std::string name = option.name + std::string(option.range.unit == Unit::Volume ? "_volume" : "");
        if constexpr (!std::is_same_v<std::remove_cvref_t<decltype(value)>, Start>) json[name] = to_json_value(value);
    });
    return json;
}

Json to_json(const SegmentReport& r) {
    Json json;
    json["resolved"] = to_json(r.resolved);
    for (const auto& [what, line] : r.automatic) json["automatic"][what] = line;
    json["grid"] = {{"voxel_size", r.domain.voxel_size},
                    {"active_voxels", r.active_voxels},
                    {"leaf_count", r.leaf_count},
                    {"domain", to_json(r.domain)}};
    if (r.band.tag_distance > 0) json["band"] = to_json(r.band);
    if (r.edge.edge_k > 0) json["edge"] = to_json(r.edge);
    for (const auto& level : r.coarse) json["coarse"].push_back(to_json(level));
    json["solve"] = to_json(r.solve);
    json["surface"] = to_json(r.surface);
    json["mesh"] = r.resolved.without_mesh ? Json{{"triangles", r.mesh.triangles}} : to_json(r.mesh);
    if (r.point_count > 0) json["fit"]["points_to_surface"] = to_json(r.fit);
    if (r.point_count > 0) json["fit"]["points_to_surface"]["bias"] = r.fit.bias;
    if (r.image_support) json["fit"]["image_support"] = *r.image_support;
    if (r.image_border)
        json["fit"]["image_border"] = {{"voxels", r.image_border->voxels},
                                       {"share", r.image_border->fraction},
                                       {"errors", r.image_border->errors}};
    if (r.marks_off.beyond > 0)
        json["fit"]["marks_off"] = {{"count", r.marks_off.count},
                                    {"beyond", r.marks_off.beyond},
                                    {"farthest",
                                     {{"distance", r.marks_off.farthest},
                                      {"world", to_json(r.marks_off.farthest_world)},
                                      {"index", to_json(r.marks_off.farthest_index)}}}};
    if (!r.inference.reason.empty()) {
        const InferenceReport& i = r.inference;
        json["inference"] = {{"used", i.used},
                             {"reason", i.reason},
                             {"bits", i.bits},
                             {"body_error", i.body_error},
                             {"guess_error", i.guess_error},
                             {"weight_of_guess", i.weight_of_guess},
                             {"agreement", i.agreement},
                             {"held_out", i.held_out},
                             {"wrong_marks", i.wrong_marks}};
        if (i.expected)
            json["expected_dice"] = {
                {"value", i.expected->value}, {"low", i.expected->low}, {"high", i.expected->high}};
    }
    if (r.guidance.used || !r.guidance.reason.empty())
        json["guidance"] = {{"used", r.guidance.used},
                            {"reason", r.guidance.reason},
                            {"feature", to_string(r.guidance.feature.feature)},
                            {"inside", r.guidance.inside},
                            {"border", r.guidance.border},
                            {"outside", r.guidance.outside},
                            {"sigma", r.guidance.sigma},
                            {"local", r.guidance.local},
                            {"gain", r.guidance.gain},
                            {"image_error", r.guidance.image_error},
                            {"guess_error", r.guidance.guess_error},
                            {"confident_share", r.guidance.confident_fraction},
                            {"mean_offset", r.guidance.mean_offset},
                            {"max_offset", r.guidance.max_offset}};
    if (r.guess.marks > 0)
        json["guess"] = {{"marks", r.guess.marks}, {"cut_marks", r.guess.cut_marks}, {"parts", r.guess.patches}};
    if (r.cloud.spacing > 0)
        json["cloud"] = {{"spacing", r.cloud.spacing},
                         {"noise", r.cloud.noise},
                         {"nearest", r.cloud.nearest},
                         {"near_reach", r.cloud.near_reach},
                         {"near_noise", r.cloud.near_noise},
                         {"encloses", r.cloud.encloses},
                         {"fills", r.cloud.fills},
                         {"averaged_within", r.cloud.radius},
                         {"stray_points", r.cloud.stray},
                         {"enclosed_points", r.cloud.enclosed},
                         {"layered_points", r.cloud.layered},
                         {"turned", r.cloud.turned},
                         {"iterations", r.cloud.iterations},
                         {"indicator_cell", r.cloud.indicator_cell},
                         {"bare_nodes", r.cloud.bare_nodes},
                         {"dropped_pieces", r.cloud.dropped_pieces},
                         {"joined_pieces", r.cloud.joined_pieces},
                         {"held_voxels", r.cloud.held_voxels}};
    if (const HintsReport& h = r.cloud.hints; h.normals + h.sensors > 0) {
        json["cloud"]["normals"] = {
            {"given", h.normals}, {"sensor_given", h.sensors}, {"used", h.used},  {"from_sensor", h.from_sensor},
            {"inward", h.inward}, {"foreseen", h.predicted},   {"agree", h.agree}};
        if (!h.why_not.empty()) json["cloud"]["normals"]["why_not"] = h.why_not;
    }
    if (r.holes.distance > 0) {
        json["holes"] = {{"policy", to_string(r.holes.policy)},
                         {"distance", r.holes.distance},
                         {"surface_without_points", r.fraction_without_points},
                         {"share", r.holes.fraction},
                         {"dropped_pieces", r.holes.dropped_pieces},
                         {"loops", Json::array()}};
        for (const BoundaryLoop& loop : r.holes.loops)
            json["holes"]["loops"].push_back({{"length", loop.length}, {"edges", loop.edges}});
    }
    if (r.seeds.inside + r.seeds.outside > 0) json["seeds"] = to_json(r.seeds);
    if (r.surface_beyond_marks) json["fit"]["surface_beyond_marks"] = *r.surface_beyond_marks;
    if (r.fraction_without_points > 0) json["fit"]["surface_without_points"] = r.fraction_without_points;
    return json;
}

std::vector<std::string> summary(const SegmentReport& r) {
    std::ostringstream text;
    text << std::setprecision(4) << r.active_voxels << " active voxels of " << r.domain.voxel_size << ", "
         << r.solve.steps << " steps (" << to_string(r.solve.stop_reason) << "), " << r.seconds.total << " s";
    std::vector<std::string> lines{
        text.str(), "surface: " + one_line(r.surface),
        "mesh: " + (r.resolved.without_mesh ? plain_mesh_line(std::uint64_t(r.mesh.triangles))
                                            : mesh_line(r.mesh.triangles, r.mesh.smallest_angle, r.mesh.deviation))};
    if (r.point_count == 0) return lines;
    text.str("");
    text << "points to surface: mean " << r.fit.mean << ", 95 % " << r.fit.p95 << ", max " << r.fit.max << ", bias "
         << r.fit.bias;
    lines.push_back(text.str());
    return lines;
}

std::string one_line(const MeshDeviation& d) {
    std::ostringstream text;
    text << std::setprecision(2) << "mean " << d.mean << ", max " << d.max << " voxels";
    return text.str();
}

std::string plain_mesh_line(std::uint64_t triangles) {
    return std::to_string(triangles) + " triangles, as produced by marching cubes";
}

std::string mesh_line(std::int64_t triangles, double smallest_angle, const MeshDeviation& deviation) {
    std::ostringstream text;
    text << triangles << " triangles, 99 % of them without an angle below " << std::setprecision(3) << smallest_angle
         << " degrees; off the level set: " << one_line(deviation);
    return text.str();
}

std::string one_line(const MeshMeasures& m) {
    std::ostringstream text;
    text << "volume " << m.volume << ", area " << m.area << ", " << m.components
         << (m.components == 1 ? " component" : " components") << ", "
         << (m.closed ? "closed, genus " + std::to_string(m.genus) : "not closed")
         << (m.manifold ? "" : ", not manifold");
    return text.str();
}

}  // namespace covol::tool
