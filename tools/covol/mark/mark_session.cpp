#include "mark/mark_session.h"

#include <algorithm>
#include <charconv>
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

namespace covol::tool {
namespace {

constexpr double kBlack = 0.002, kWhite = 0.998;  // fractions of the voxels below what is shown black and white
constexpr int kSuggestions = 5;
constexpr double kMostRead = double(1 << 27);  // voxels of an image in chunks, for a mean intensity

const char* word_of(StudyResult::Stage stage) {
    switch (stage) {
        case StudyResult::Stage::Empty: return "empty";
        case StudyResult::Stage::Working: return "working";
        case StudyResult::Stage::First: return "first";
        case StudyResult::Stage::Refined: return "refined";
        case StudyResult::Stage::Failed: break;
    }
    return "failed";
}

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

serve::Response refused(int status, const std::string& why) {
    serve::Response response;
    response.status = status;
    response.body = why + "\n";
    return response;
}

std::int64_t number_of(const serve::Request& request, const std::string& name) {
    const auto found = request.query.find(name);
    std::int64_t value = -1;
    if (found != request.query.end()) {
        const std::string& text = found->second;
        const auto end = text.data() + text.size();
        if (const auto read = std::from_chars(text.data(), end, value); read.ec == std::errc() && read.ptr == end)
            return value;
    }
    throw Error(Errc::InvalidInput, "'" + name + "': expected a whole number");
}

/// Where marks and edges hold all of a surface: its places that lie farthest from marks, and from each other.
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

Json result_json(const StudyResult& result, std::uint64_t version,
                 const std::optional<IntensityStatistics>& intensity) {
    Json json{{"structure", result.structure},  {"version", version},          {"seq", result.sequence},
              {"stage", word_of(result.stage)}, {"progress", result.progress}, {"message", result.message},
              {"seconds", result.seconds}};
    if (!result.surface) return json;
    const SegmentReport& report = result.surface->report;
    Vec3 low{}, high{};
    for (std::size_t a = 0; a < 3; ++a) {
        const auto less = [a](const auto& p, const auto& q) { return p[a] < q[a]; };
        const auto& vertices = result.surface->mesh.vertices;
        if (vertices.empty()) break;
        const auto [first, last] = std::minmax_element(vertices.begin(), vertices.end(), less);
        low[a] = (*first)[a];
        high[a] = (*last)[a];
    }
    json["triangles"] = result.surface->mesh.triangles.size();
    json["volume"] = report.surface.volume;
    json["area"] = report.surface.area;
    json["extent"] = {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
    json["mean"] = json["sd"] = nullptr;
    if (intensity && intensity->voxels > 0) {
        json["mean"] = intensity->mean;
        json["sd"] = intensity->standard_deviation;
    }
    json["expected"] = nullptr;
    if (const auto& expected = report.inference.expected)
        json["expected"] = {{"value", expected->value}, {"low", expected->low}, {"high", expected->high}};
    json["warnings"] = report.warnings;
    return json;
}

Json options_json(const StudyOptions& options) {
    return Json::parse(covol::to_json(KeyedAction{"", StudyActions::SetOptions{options}})).at("options");
}

}  // namespace

RunContext quiet(RunContext run) {
    run.log = nullptr;
    run.progress = nullptr;
    return run;
}

MarkSession::MarkSession(Study study, ImageLevels levels, std::function<Image()> image, MarkView view,
                         const RunContext& run)
    : levels_(std::move(levels)),
      image_(std::move(image)),
      geometry_(levels_.image().geometry()),
      view_(std::move(view)),
      run_(quiet(run)),
      study_(std::move(study)) {
    range_ = levels_.range(run_);
    if (!(range_[1] > range_[0])) range_[1] = range_[0] + 1;
    window_ = levels_.percentiles(kBlack, kWhite, run_);
    if (!(window_[1] > window_[0])) window_ = range_;
    // Of an image in chunks only some were looked at.
    range_ = {std::min(range_[0], window_[0]), std::max(range_[1], window_[1])};
}

void MarkSession::start(Send send, Broadcast broadcast) {
    send_ = std::move(send);
    broadcast_ = std::move(broadcast);
    solver_ = std::make_unique<StudySolver>(
        image_, options(), [this](const StudyResult& r) { hear(r); }, run_, view_.site.read_guess);
    const std::lock_guard lock(mutex_);
    std::vector<StudyId> all;
    for (const auto& structure : study_.state()) all.push_back(structure->id);
    follow(all);
}

/// Solves what has other marks now. @pre locked
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
        solved.is_refined = false;
        solver_->solve(structure, study_.sequence());
    }
}

/// On the solver's thread.
void MarkSession::hear(const StudyResult& result) {
    std::string text;
    std::optional<IntensityStatistics> intensity;
    if (result.stage == StudyResult::Stage::Refined)
        intensity = intensity_within(image_(), *result.surface->surface, kMostRead, run_);
    {
        const std::lock_guard lock(mutex_);
        const auto found = solved_.find(result.structure);
        if (found == solved_.end()) return;
        Solved& solved = found->second;
        if (result.stage == StudyResult::Stage::Empty) {
            solved.surface = nullptr;
            solved.version = 0;
        }
        if (result.surface) {
            solved.surface = result.surface;
            solved.version = result.version;
            solved.is_refined = result.stage == StudyResult::Stage::Refined;
        }
        solved.intensity = intensity;
        Json told = result_json(result, solved.version, intensity);
        text = text_of({{"result", told}});
        if (result.stage != StudyResult::Stage::Working) solved.told = std::move(told);
    }
    broadcast_(std::move(text));
}

Json MarkSession::to_json(const StudyStructure& structure) const {
    Json marks = Json::array(), outlines = Json::array(), strokes = Json::array();
    for (const StudyMark& m : structure.marks)
        marks.push_back({{"id", m.id}, {"kind", kWords<MarkKind>[std::size_t(m.kind)]}, {"world", m.world}});
    for (const StudyOutline& o : structure.outlines)
        outlines.push_back({{"id", o.id}, {"axis", o.axis}, {"at", o.at}, {"closed", o.closed}, {"world", o.world}});
    for (const StudyStroke& s : structure.strokes) {
        Json stroke{{"id", s.id}, {"erases", s.erases}, {"radius", s.radius}, {"world", s.world}};
        if (s.axis) stroke.update({{"axis", *s.axis}, {"at", s.at}});
        strokes.push_back(std::move(stroke));
    }
    Json json{{"id", structure.id},
              {"name", structure.name},
              {"color", structure.color},
              {"locked", structure.locked},
              {"visible", structure.visible},
              {"marks", std::move(marks)},
              {"outlines", std::move(outlines)},
              {"strokes", std::move(strokes)},
              {"guess", nullptr},
              {"result", nullptr}};
    if (structure.guess)  // pages need not know where it lies
        json["guess"] = {{"name", std::filesystem::path(structure.guess->path).filename().string()},
                         {"label", structure.guess->label}};
    if (const auto solved = solved_.find(structure.id); solved != solved_.end()) json["result"] = solved->second.told;
    return json;
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
        // Without a key nobody waits for an answer.
        const Json sent = Json::parse(text, nullptr, false);
        constexpr std::string_view kSource = "study: ";  // which goes without saying
        std::string_view why = error.what();
        if (why.starts_with(kSource)) why.remove_prefix(kSource.size());
        Json answer{{"failed", nullptr}, {"why", why}};
        if (sent.is_object() && sent.contains("key")) answer["failed"] = sent["key"];
        send_(client, text_of(answer));
    }
}

void MarkSession::act(serve::Client client, std::string_view text) {
    if (text.find("\"ask\"") != std::string_view::npos) {
        const Json asked = parse_json(std::string(text), "message");
        if (asked.is_object() && asked.value("ask", Json()) == "suggest" && asked.contains("structure") &&
            asked["structure"].is_number_unsigned())
            return suggest(client, asked["structure"].get<StudyId>());
    }
    const KeyedAction action = parse_study_action(text);
    if (names_file(action.action)) throw Error(Errc::InvalidInput, "study: a page names no files");
    const std::lock_guard lock(mutex_);
    const Study::Applied applied = apply(action);
    Json answer{{"done", action.key}, {"seq", study_.sequence()}};
    if (applied.changed.made != 0) answer["id"] = applied.changed.made;
    send_(client, text_of(answer));
}

Study::Applied MarkSession::apply(const KeyedAction& action) {
    Study::Applied applied = study_.apply(action);
    tell(applied.changed);
    return applied;
}

void MarkSession::tell(const StudyHistory::Changed& changed) {
    std::vector<StudyId> structures = changed.structures;
    if (changed.options) {
        solver_->set_options(options());
        for (auto& [id, solved] : solved_) {
            solved.from = nullptr;  // with other options it has another surface
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
    std::shared_ptr<const StudyStructure> structure;
    {
        const std::lock_guard lock(mutex_);
        structure = study_.history().find(id);
        if (const auto found = solved_.find(id); found != solved_.end()) surface = found->second.surface;
    }
    Json places = Json::array();
    if (structure && surface) {
        std::vector<Vec3> marks;
        for (const StudyMark& mark : structure->marks)
            if (mark.kind == MarkKind::Surface) marks.push_back(mark.world);
        std::vector<Vec3> suggested;
        for (const Suggestion& s : assess_evidence(*surface, marks, image_(), kSuggestions, run_).suggestions)
            suggested.push_back(s.world);
        if (suggested.empty()) suggested = farthest_from(marks, surface->mesh, kSuggestions);
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
        if (request.path == "/image") return image_facts();
        if (request.path == "/slice") return slice(request);
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
                throw Error(Errc::InvalidInput, std::string("'") + name + "': expected one");
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

serve::Response MarkSession::image_facts() const {
    const ImageGeometry& g = geometry_;
    Json levels = Json::array();
    for (const ImageLevels::Level& level : levels_.levels()) levels.push_back(level.factor);
    serve::Response response;
    response.type = "application/json";
    response.body = text_of({{"name", view_.title},
                             {"size", g.size},
                             {"spacing", g.spacing},
                             {"origin", g.origin},
                             {"direction", g.direction},
                             {"unit", g.unit},
                             {"anatomical", view_.is_anatomical},
                             {"levels", levels},
                             {"in_chunks", levels_.is_in_chunks()},
                             {"low", range_[0]},
                             {"high", range_[1]},
                             {"black", window_[0]},
                             {"white", window_[1]},
                             {"first_slice", 0}});
    return response;
}

serve::Response MarkSession::slice(const serve::Request& request) const {
    constexpr std::int64_t kMost = std::int64_t(1) << 30;
    const auto small = [&](const char* name) { return int(std::min(number_of(request, name), kMost)); };
    SliceRequest wanted{small("axis"), small("at"), small("step"), {}};
    if (request.query.contains("width"))
        wanted.part = SliceRequest::Part{small("x"), small("y"), small("width"), small("height")};
    RunContext run = run_;
    run.cancel = request.gone.get();  // the page turned to another slice
    PageSlice coded = make_page_slice(levels_, wanted, range_, run);
    serve::Response response;
    response.type = "application/octet-stream";
    response.body = std::move(coded.bytes);
    response.is_deflated = true;
    response.headers = {{"X-Width", std::to_string(coded.width)},
                        {"X-Height", std::to_string(coded.height)},
                        {"X-Factor", std::to_string(coded.factor)}};
    return response;
}

serve::Response MarkSession::mesh(const serve::Request& request) const {
    const StudyId id = number_of(request, "structure");
    const std::int64_t version = number_of(request, "version");
    std::shared_ptr<const SegmentResult> surface;
    {
        const std::lock_guard lock(mutex_);
        const auto found = solved_.find(id);
        if (found != solved_.end() && std::int64_t(found->second.version) == version) surface = found->second.surface;
    }
    if (!surface) return refused(404, "a newer surface takes its place");
    serve::Response response;
    response.type = "application/octet-stream";
    response.body = make_page_mesh(surface->mesh);
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
    if (format == request.query.end()) throw Error(Errc::InvalidInput, "'format': expected one");
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
        [&](const StructureResult& s) { return intensity_within(image_(), *s.result.surface, kMostRead, run_); },
        levels_.image(), study_.folder(), run_);
    serve::Response response;
    response.type = "application/octet-stream";
    response.body = std::move(made.bytes);
    response.file_name = std::move(made.name);
    return response;
}

}  // namespace covol::tool
