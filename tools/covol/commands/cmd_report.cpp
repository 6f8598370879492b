#include <filesystem>
#include <fstream>

#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/domain.h"
#include "covol/edge.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "covol/mesh_relax.h"
#include "covol/structures.h"
#include "covol/surface.h"
#include "flags/contour_flags.h"
#include "jobs/level_sets.h"
#include "jobs/page.h"

namespace covol::tool {
namespace {

// [voxels] Distance up to which a mark supports the surface, as large as the automatic attraction range of a run.
constexpr double kReachVoxels = 2 * kHalfWidthVoxels;

/// One level set of the file, and the marks and evidence that it is compared with.
struct Shown {
    std::string grid;
    FloatGridPtr surface;
    TriangleMesh mesh;
    std::vector<Vec3> marks;
    std::optional<Evidence> evidence;
    Json facts;
};

struct ReportPageJob {
    std::string input, output, image_path, run_report;
    PointFlags points;
    ContourFlags contours;
    ImageFlags image;
    int suggestions = kPageSuggestions;

    void run(Session& session) const {
        session.outputs().check("-o", output, OutputKind::Page);
        if (suggestions < 0)
            throw Error(Errc::InvalidOptions, "--suggest: expected >= 0, got " + std::to_string(suggestions));
        Json facts = read_facts(session);
        std::vector<Shown> all = read_surfaces(session.run());
        std::optional<Image> pixels;
        if (!image_path.empty()) pixels = image.read(image_path, session.run());
        add_marks(all, pixels ? std::optional(pixels->geometry()) : std::nullopt, session.run());
        if (pixels) {
            facts["input"]["image"] = to_json(pixels->geometry());
            facts["input"]["image"]["path"] = image_path;
        }
        const Stopwatch watch;
        for (Shown& shown : all) judge(shown, pixels ? &*pixels : nullptr, session.run());
        session.add_seconds("surface", watch.seconds());
        add_facts(all, facts, session);
        const auto page = std::make_shared<ReportPage>();
        const auto kept = std::make_shared<std::vector<Shown>>(std::move(all));
        const auto slices = std::make_shared<std::optional<Image>>(std::move(pixels));
        page->title = std::filesystem::path(split_grid_name(input).path).filename().string();
        page->facts = facts.dump(-1, ' ', false, Json::error_handler_t::replace);
        for (const Shown& shown : *kept) {
            PageStructure structure{shown.grid, {}, &shown.mesh, shown.marks, nullptr};
            structure.color = kept->size() > 1 ? structure_color(page->structures.size()) : PageStructure{}.color;
            if (shown.evidence) structure.evidence = &*shown.evidence;
            page->structures.push_back(std::move(structure));
        }
        if (*slices) {
            page->image = &**slices;
            page->unit = (*slices)->geometry().unit;
            page->is_anatomical = is_anatomical(image_path, image.options, session.run());
        }
        session.outputs().add(
            output, [page, kept, slices, &session](const std::string& path) { write_page(path, *page, session); });
    }

private:
    /// The given report of the run, or the facts that are stored in the .vdb.
    [[nodiscard]] Json read_facts(const Session& session) const {
        Json facts = page_facts(session);
        if (!run_report.empty()) return with_run(std::move(facts));
        const std::vector<VdbGridInfo> grids = list_vdb(input);
        if (grids.empty()) return facts;
        for (const auto& [key, value] : grids.front().metadata) {
            const Json parsed = Json::parse(value, nullptr, false);
            if (key == "covol_resolved" && parsed.is_object()) facts["resolved"] = parsed;
        }
        return facts;
    }

    /// Adds the fields of the report that --run-report names. Other fields than those that covol writes are ignored.
    [[nodiscard]] Json with_run(Json facts) const {
        std::ifstream file = open_regular_file(run_report);
        if (!file) throw Error(Errc::Io, "--run-report: " + run_report + ": cannot open");
        const Json loaded = Json::parse(file, nullptr, false);
        if (!loaded.is_object() || !loaded.contains("covol"))
            throw Error(Errc::InvalidInput,
                        "--run-report: " + run_report + ": expected a report that covol wrote with --json");
        for (const char* name :
             {"input", "resolved", "automatic", "grid", "solve", "surface", "fit", "seconds", "expected_dice"})
            if (loaded.contains(name) && loaded[name].is_object()) facts[name] = loaded[name];
        if (loaded.contains("warnings") && loaded["warnings"].is_array()) facts["warnings"] = loaded["warnings"];
        if (loaded.contains("structures") && loaded["structures"].is_array())
            for (const Json& structure : loaded["structures"])
                if (structure.is_object()) facts["structures"].push_back(structure);
        return facts;
    }

    /// Whether a run's report on a structure belongs to this level set.
    [[nodiscard]] static bool is_about(const Json& loaded, const std::string& grid) {
        for (const char* name : {"vdb_grid", "name"})
            if (loaded.contains(name) && loaded[name] == grid) return true;
        return false;
    }

    [[nodiscard]] std::vector<Shown> read_surfaces(const RunContext& run) const {
        std::vector<Shown> all;
        for (NamedLevelSet& found : read_level_sets(input, run))
            all.push_back({found.name, std::move(found.surface), {}, {}, {}, {}});
        return all;
    }

    void add_marks(std::vector<Shown>& all, const std::optional<ImageGeometry>& geometry, const RunContext& run) const {
        std::vector<std::string> names;
        for (const Shown& shown : all) names.push_back(shown.grid);
        const auto add = [&](const char* flag, const std::string& text, bool are_contours) {
            const Named file = split_name(text);
            Shown& shown = all[owner_of(names, flag, file, "FILE")];
            Marks marks;
            (are_contours ? marks.files.contours : marks.files.points).push_back(file.value);
            read_marks(marks, geometry, reading_of(points, run), run);
            const std::vector<Vec3> given = positions_of(marks, geometry);
            shown.marks.insert(shown.marks.end(), given.begin(), given.end());
            shown.facts["input"][are_contours ? "contours" : "points"]["paths"].push_back(file.value);
        };
        for (const std::string& text : points.paths) add("--points", text, false);
        for (const std::string& text : contours.paths) add("--contours", text, true);
    }

    void judge(Shown& shown, const Image* pixels, const RunContext& run) const {
        const double h = domain_of(*shown.surface).voxel_size;
        shown.mesh = extract_mesh(*shown.surface, {}, run);
        if (shown.mesh.empty())
            throw Error(Errc::InvalidInput, input + ": grid '" + shown.grid + "': expected a surface, found none");
        relax_mesh(shown.mesh, *shown.surface, {}, run);
        shown.facts["grid"] = {{"voxel_size", h}};
        shown.facts["surface"] = to_json(measure(shown.mesh));
        if (!shown.marks.empty())
            shown.facts["fit"]["points_to_surface"] = to_json(measure_fit(shown.marks, shown.mesh, run));
        if (pixels == nullptr) return;
        EvidenceOptions options;
        options.reach = kReachVoxels * h;
        options.suggestions = suggestions;
        const EdgeResult edges = detect_edges(*pixels, *shown.surface, {}, run);
        shown.evidence = assess_evidence(shown.mesh, shown.marks, *edges.grid, pixels->geometry(), options, run);
        shown.facts["evidence"] = to_json(*shown.evidence);
    }

    static void add_facts(const std::vector<Shown>& all, Json& facts, Session& session) {
        if (all.size() == 1) {
            session.report().update(all.front().facts, true);
            facts.update(all.front().facts, true);
            return;
        }
        Json list = Json::array();
        for (const Shown& shown : all) {
            Json loaded{{"name", shown.grid}};
            for (const Json& known : facts.value("structures", Json::array()))
                if (is_about(known, shown.grid)) loaded.update(known, true);
            loaded["name"] = shown.grid;
            if (facts.contains("resolved") && facts["resolved"].contains(shown.grid))
                loaded["resolved"] = facts["resolved"][shown.grid];
            loaded.update(shown.facts, true);
            list.push_back(loaded);
        }
        facts.erase("resolved");
        facts["structures"] = list;
        session.report()["structures"] = list;
    }
};

}  // namespace

void add_report(Session& session) {
    const auto [job, command] = session.add_job<ReportPageJob>(
        "report",
        "Write a page for the browser: surfaces in 3D, slices with outlines and marks, measurements, options");
    bind_level_sets(*command, job->input);
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->output, "the page, which needs no network")
        ->required()
        ->type_name("OUT.html");
    in_group(*command, Group::Input);
    command->add_option("--image", job->image_path, "image for the slices")->type_name("IMAGE");
    command
        ->add_option("--run-report", job->run_report,
                     "report that the run wrote with --json, with its times, options and automatic choices")
        ->type_name("REPORT.json");
    job->points.bind(*command, "--points")
        ->description("marks on the surface; for several level sets with their names, ve=FILE exe=FILE")
        ->type_name("[NAME=]FILE...");
    in_group(*command, Group::Output);
    command
        ->add_option("--suggest", job->suggestions,
                     "suggest the N slices in which new marks would help most, and a position in each")
        ->type_name("N")
        ->capture_default_str();
    job->contours.bind(*command, true);
    job->image.bind(*command);
    session.help().show_first(*command,
                              {"--image", "--points", "--contours", "--run-report", "--suggest", "--channel"});
}

}  // namespace covol::tool
