#include "mark/mark_session.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "covol/error.h"
#include "covol/page_data.h"
#include "covol/safe_text.h"
#include "covol/segment_structures.h"
#include "jobs/structure_outputs.h"
#include "mark/exports.h"
#include "mark/imports.h"
#include "mark/mark_json.h"
#include "mark/request_fields.h"

namespace covol::tool {
namespace {

constexpr int kSuggestions = 5;
constexpr std::uint64_t kKeptVersion = 1;     // version number of kept surfaces; new surfaces have larger ones
constexpr double kMaxRead = double(1 << 27);  // maximum number of voxels read for the intensity inside a surface

serve::Response refused(int status, const std::string& why) {
    serve::Response response;
    response.status = status;
    response.body = why + "\n";
    return response;
}

/// Positions on a surface that are far from the marks and from each other. They are suggested if assess_evidence()
/// suggests none, because the surface is fully supported, or if only a mesh from an earlier session is available.
std::vector<Vec3> farthest_from(const std::vector<Vec3>& marks, const TriangleMesh& mesh, int count) {
    std::vector<Vec3> places;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) places.push_back(mesh.place(v));
    std::vector<double> away(places.size(), std::numeric_limits<double>::max());
    const auto lower = [&](const Vec3& mark) {
        for (std::size_t v = 0; v < places.size(); ++v)
            away[v] =
                std::min(away[v], std::hypot(places[v][0] - mark[0], places[v][1] - mark[1], places[v][2] - mark[2]));
    };
    std::for_each(marks.begin(), marks.end(), lower);
    std::vector<Vec3> found;
    while (!places.empty() && int(found.size()) < count) {
        found.push_back(places[std::size_t(std::max_element(away.begin(), away.end()) - away.begin())]);
        lower(found.back());
    }
    return found;
}

bool is_same_mesh(const TriangleMesh& a, const TriangleMesh& b) {
    return a.vertices == b.vertices && a.triangles == b.triangles && a.origin == b.origin;
}

}  // namespace

RunContext quiet(RunContext run) {
    run.log = nullptr;
    run.progress = nullptr;
    return run;
}

MarkSession::MarkSession(Study study, std::unique_ptr<PageImage> seen, std::function<Image()> image, MarkView view,
                         const RunContext& run)
    : page_image_(std::move(seen)),
      image_(std::move(image)),
      geometry_(page_image_->image().geometry()),
      view_(std::move(view)),
      run_(quiet(run)),
      kept_(study.folder(), view_.image_digest),
      study_(std::move(study)) {}

void MarkSession::start(Send send, Broadcast broadcast) {
    send_ = std::move(send);
    broadcast_ = std::move(broadcast);
    solver_ = std::make_unique<StudySolver>(
        image_, options(), [this](const StudyResult& r) { receive(r); }, run_, view_.site.read_guess);
    const std::lock_guard lock(mutex_);
    std::vector<StudyId> unknown;
    for (const auto& structure : study_.state())
        if (!show_kept(structure)) unknown.push_back(structure->id);
    follow(unknown);
}

bool MarkSession::show_kept(const std::shared_ptr<const StudyStructure>& structure) {
    std::optional<KeptSurfaces::Kept> kept = kept_.find(*structure, study_.history().options());
    if (!kept) return false;
    Solved& solved = solved_[structure->id];
    solved.from = structure;
    solved.requested = study_.sequence();
    solved.version = kKeptVersion;
    solved.kept = std::move(kept->mesh);
    solved.reported = std::move(kept->figures);
    // The surface is reported as a first result, not as a refined one: the image may differ in parts that its digest
    // does not cover.
    solved.reported.update({{"structure", structure->id},
                            {"version", solved.version},
                            {"seq", solved.requested},
                            {"stage", stage_name(StudyResult::Stage::First)},
                            {"progress", 0},
                            {"message", ""}});
    solver_->confirm(structure, solved.requested);
    return true;
}

/// Starts the solver for each of these structures whose marks, outlines, paint or guess have changed; removes deleted
/// structures from the solver. @pre `mutex_` is locked
void MarkSession::follow(const std::vector<StudyId>& structures) {
    for (const StudyId id : structures) {
        const auto structure = study_.history().find(id);
        if (!structure) {
            solved_.erase(id);
            solver_->forget(id);
            continue;
        }
        Solved& solved = solved_[id];
        if (solved.from ? solved.from->has_same_evidence(*structure) : !structure->has_evidence()) continue;
        solved.from = structure;
        solved.requested = study_.sequence();
        solved.is_refined = false;
        solver_->solve(structure, solved.requested);
    }
}

/// Handles a result of the solver; called on its thread.
void MarkSession::receive(const StudyResult& result) {
    std::string text;
    std::optional<IntensityStatistics> intensity;
    Json reported;
    std::shared_ptr<const StudyStructure> from;  // if not null, the structure for which kept_ stores the new surface
    StudyOptions options;
    if (result.stage == StudyResult::Stage::Refined)
        intensity = intensity_within(image_(), *result.surface->surface, kMaxRead, run_);
    {
        const std::lock_guard lock(mutex_);
        const auto found = solved_.find(result.structure);
        if (found == solved_.end()) return;
        Solved& solved = found->second;
        if (result.stage == StudyResult::Stage::Empty) {
            solved.surface = nullptr;
            solved.kept = nullptr;
            solved.version = 0;
        }
        if (result.surface) {
            // The version of an unchanged mesh stays the same, so that pages do not request it again.
            const bool is_same = solved.kept && is_same_mesh(*solved.kept, result.surface->mesh);
            if (!is_same) {
                solved.kept = nullptr;
                solved.version = kKeptVersion + result.version;
            }
            solved.surface = result.surface;
            solved.is_refined = result.stage == StudyResult::Stage::Refined;
            if (solved.is_refined && !is_same && solved.from && result.sequence == solved.requested) {
                from = solved.from;
                options = study_.history().options();
            }
        }
        solved.intensity = intensity;
        reported = result_json(result, solved.version, intensity);
        text = text_of({{"result", reported}});
        if (result.stage != StudyResult::Stage::Working) solved.reported = reported;
    }
    broadcast_(std::move(text));
    if (from) kept_.keep(*from, options, reported, result.surface->mesh);
}

std::shared_ptr<const TriangleMesh> MarkSession::mesh_of(const Solved& solved) {
    if (solved.surface) return {solved.surface, &solved.surface->mesh};
    return solved.kept;
}

Json MarkSession::to_json(const StudyStructure& structure) const {
    const auto solved = solved_.find(structure.id);
    return structure_json(structure, solved != solved_.end() ? solved->second.reported : Json());
}

Json MarkSession::standing() const {
    return {{"seq", study_.sequence()},
            {"can_undo", study_.history().can_undo()},
            {"can_redo", study_.history().can_redo()},
            {"options", options_json(study_.history().options())}};
}

void MarkSession::opened(serve::Client client) {
    const std::lock_guard lock(mutex_);
    Json state = standing();
    state["study"] = view_.title;
    state["structures"] = Json::array();
    for (const auto& structure : study_.state()) state["structures"].push_back(to_json(*structure));
    send_(client, text_of({{"state", std::move(state)}}));
}

void MarkSession::message(serve::Client client, std::string_view text) {
    try {
        act(client, text);
    } catch (const Error& error) {
        // The answer contains the key of the failed action, if it has one, so that the page can find the action.
        const Json sent = Json::parse(text, nullptr, false);
        constexpr std::string_view kSource = "study: ";  // a prefix that is redundant on the page
        std::string_view why = error.what();
        if (why.starts_with(kSource)) why.remove_prefix(kSource.size());
        Json answer{{"failed", nullptr}, {"why", why}};
        if (sent.is_object() && sent.contains("key")) answer["failed"] = sent["key"];
        send_(client, text_of(answer));
    }
}

void MarkSession::act(serve::Client client, std::string_view text) {
    if (text.find("\"ask\"") != std::string_view::npos) {
        const Json requested = parse_json(std::string(text), "message");
        if (requested.is_object() && requested.value("ask", Json()) == "suggest" && requested.contains("structure") &&
            requested["structure"].is_number_unsigned())
            return suggest(client, requested["structure"].get<StudyId>());
    }
    const KeyedAction action = parse_study_action(text);
    if (names_file(action.action)) throw Error(Errc::InvalidInput, "study: a page cannot name files");
    const std::lock_guard lock(mutex_);
    const Study::Applied applied = apply(action);
    Json answer{{"done", action.key}, {"seq", study_.sequence()}};
    if (applied.changed.made != 0) answer["id"] = applied.changed.made;
    send_(client, text_of(answer));
}

Study::Applied MarkSession::apply(const KeyedAction& action) {
    Study::Applied applied = study_.apply(action);
    publish(applied.changed);
    return applied;
}

void MarkSession::publish(const StudyHistory::Changed& changed) {
    std::vector<StudyId> structures = changed.structures;
    if (changed.options) {
        solver_->set_options(options());
        for (auto& [id, solved] : solved_) {
            solved.from = nullptr;  // so that follow() solves the structure again, with the new options
            structures.push_back(id);
        }
    }
    if (structures.empty() && !changed.options) return;
    follow(structures);
    Json patch = standing();
    patch["structures"] = Json::array();
    patch["removed"] = Json::array();
    patch["order"] = Json::array();
    for (const StudyId id : structures)
        if (const auto structure = study_.history().find(id))
            patch["structures"].push_back(to_json(*structure));
        else
            patch["removed"].push_back(id);
    for (const auto& structure : study_.state()) patch["order"].push_back(structure->id);
    broadcast_(text_of({{"patch", std::move(patch)}}));
}

void MarkSession::suggest(serve::Client client, StudyId id) {
    std::shared_ptr<const SegmentResult> surface;
    std::shared_ptr<const TriangleMesh> shown;
    std::shared_ptr<const StudyStructure> structure;
    {
        const std::lock_guard lock(mutex_);
        structure = study_.history().find(id);
        if (const auto found = solved_.find(id); found != solved_.end()) {
            surface = found->second.surface;
            shown = mesh_of(found->second);
        }
    }
    Json places = Json::array();
    if (structure && shown) {
        std::vector<Vec3> marks;
        for (const StudyMark& mark : structure->marks)
            if (mark.kind == MarkKind::Surface) marks.push_back(mark.world);
        std::vector<Vec3> suggested;
        if (surface)
            for (const Suggestion& s : assess_evidence(*surface, marks, image_(), kSuggestions, run_).suggestions)
                suggested.push_back(s.world);
        if (suggested.empty()) suggested = farthest_from(marks, *shown, kSuggestions);
        for (const Vec3& place : suggested)
            places.push_back({{"world", place}, {"index", geometry_.world_to_index(place)}});
    }
    send_(client, text_of({{"suggestions", {{"structure", id}, {"places", std::move(places)}}}}));
}

serve::Response MarkSession::get(const serve::Request& request) {
    try {
        if (request.path == "/") {
            serve::Response response;
            response.type = "text/html; charset=utf-8";
            response.body = view_.page;
            return response;
        }
        if (request.path == "/image") return page_image_->facts();
        if (request.path == "/channel") return page_image_->channel(request);
        if (request.path == "/oblique") return page_image_->oblique(request);
        if (request.path == "/slice") return page_image_->slice(request);
        if (request.path == "/mesh") return mesh(request);
        if (request.path == "/export") return download(request);
    } catch (const Error& error) {
        const bool is_theirs = error.code() == Errc::InvalidInput || error.code() == Errc::InvalidOptions;
        return refused(is_theirs ? 400 : 500, error.what());
    }
    return refused(404, "there is nothing here");
}

serve::Response MarkSession::post(const serve::Request& request, const std::string& body) {
    try {
        if (request.path != "/import") return refused(404, "there is nothing here");
        const auto text = [&](const char* name) {
            const auto found = request.query.find(name);
            if (found == request.query.end())
                throw Error(Errc::InvalidInput, std::string("'") + name + "': expected a value, got none");
            return found->second;
        };
        const std::string key = text("key");
        const std::string as = text("as");
        const StudyId structure = as == "labels" ? 0 : number_of(request, "structure");
        const GivenFile file = keep_file(text("name"), body, as == "points", study_.folder(), run_);
        StudyState state;
        {
            const std::lock_guard lock(mutex_);
            state = study_.state();
        }
        const StudyAction action =
            as == "points"   ? import_points(file.path(), structure, view_.site.image, run_)
            : as == "guess"  ? import_guess(file.path(), structure, study_.folder(), view_.site, run_)
            : as == "labels" ? import_labels(file.path(), study_.folder(), state, view_.site, run_)
                             : throw Error(Errc::InvalidInput, "'as': expected points, guess or labels");
        const std::lock_guard lock(mutex_);
        const Study::Applied applied = apply({key, action});
        if (as != "points") file.keep();
        serve::Response response;
        response.type = "application/json";
        response.body = text_of({{"seq", study_.sequence()}, {"id", applied.changed.made}});
        return response;
    } catch (const Error& error) {
        const bool is_theirs = error.code() != Errc::Io;
        return refused(is_theirs ? 400 : 500, error.what());
    }
}

serve::Response MarkSession::mesh(const serve::Request& request) const {
    const StudyId id = number_of(request, "structure");
    const std::int64_t version = number_of(request, "version");
    std::shared_ptr<const TriangleMesh> surface;
    {
        const std::lock_guard lock(mutex_);
        const auto found = solved_.find(id);
        if (found != solved_.end() && std::int64_t(found->second.version) == version) surface = mesh_of(found->second);
    }
    if (!surface)
        return refused(
            404, "this surface does not exist any more: it was replaced by a newer one, or its structure was deleted");
    serve::Response response;
    response.type = "application/octet-stream";
    response.body = make_page_mesh(*surface);
    response.is_deflated = true;
    return response;
}

StructuresResult MarkSession::results() {
    StudyState state;
    std::map<std::string, std::shared_ptr<const SegmentResult>> known;
    SegmentOptions how;
    {
        const std::lock_guard lock(mutex_);
        state = study_.state();
        how = options();
        for (const auto& structure : state)
            if (const auto found = solved_.find(structure->id); found != solved_.end() && found->second.is_refined)
                known[safe_text(structure->name)] = found->second.surface;
    }
    std::vector<Marks> marks = marks_of(state, view_.site);
    if (marks.empty()) throw Error(Errc::InvalidInput, "no structure has marks yet");
    number_labels(marks);
    const auto solve = [&](const std::optional<Image>& image, const StructureInput& structure, const RunContext& run) {
        const auto found = known.find(structure.name);
        return found != known.end() ? *found->second : solve_structure(image, structure, run);
    };
    return segment_structures(image_(), std::move(marks), {how, {}}, run_, solve);
}

serve::Response MarkSession::download(const serve::Request& request) {
    const auto format = request.query.find("format");
    if (format == request.query.end()) throw Error(Errc::InvalidInput, "'format': expected a value, got none");
    StudyState state;
    {
        const std::lock_guard lock(mutex_);
        state = study_.state();
    }
    const StudyId id = number_of(request, "structure");
    if (id != 0) {
        std::erase_if(state, [&](const auto& structure) { return structure->id != id; });
        if (state.empty()) throw Error(Errc::InvalidInput, "there is no structure " + std::to_string(id));
    }
    Export made = make_export(
        format->second, state, [&] { return results(); },
        [&](const StructureResult& s) { return intensity_within(image_(), *s.result.surface, kMaxRead, run_); },
        page_image_->image(), study_.folder(), run_);
    serve::Response response;
    response.type = "application/octet-stream";
    response.body = std::move(made.bytes);
    response.file_name = std::move(made.name);
    return response;
}

}  // namespace covol::tool
