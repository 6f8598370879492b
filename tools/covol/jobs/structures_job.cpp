#include "jobs/structures_job.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <optional>
#include <sstream>

#include "cli/report.h"
#include "covol/error.h"
#include "covol/mesh_stream.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"
#include "jobs/marks.h"
#include "jobs/page.h"
#include "jobs/paint_reader.h"
#include "jobs/usd_scene.h"

namespace covol::tool {
namespace {

constexpr std::size_t kMostInLines = 4;  // structures; of more there is a table, and no line for each step

/// A context whose lines begin with the structure's name. @param brief  warnings alone
RunContext speaking_for(const std::string& name, bool brief, const RunContext& run) {
    RunContext named = run;
    if (!name.empty() && run.log)
        named.log = [log = run.log, name, brief](LogLevel level, const std::string& line) {
            if (!brief || level == LogLevel::Warning) log(level, name + ": " + line);
        };
    return named;
}

/// A core that the points enclose is farther than D from all of them, and lies in their box.
void check_tag_distance(double tag_distance, const std::vector<Vec3>& points) {
    if (points.empty()) return;
    const WorldBox box = bounding_box(points);
    const double diagonal = std::hypot(box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2]);
    if (tag_distance <= diagonal) return;
    std::ostringstream text;
    text << "--tag-distance: " << tag_distance << " is more than the points' whole box measures, " << diagonal
         << ": nothing that they enclose is that far from them";
    throw Error(Errc::InvalidOptions, text.str());
}

/// Up to rounding in files.
bool is_same_lattice(const ImageGeometry& a, const ImageGeometry& b) {
    if (a.size != b.size) return false;
    const double slack = 1e-3 * *std::min_element(b.spacing.begin(), b.spacing.end());
    for (const Vec3& corner :
         {Vec3{0, 0, 0}, Vec3{double(a.size[0]), 0, 0}, Vec3{0, double(a.size[1]), 0}, Vec3{0, 0, double(a.size[2])}}) {
        const Vec3 p = a.index_to_world(corner), q = b.index_to_world(corner);
        if (std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) > slack) return false;
    }
    return true;
}

void measure_again(StructureOutput& s, const ExtractOptions& extract, const RunContext& run) {
    SegmentReport& report = s.result.report;
    const FloatGrid& surface = *s.result.surface;
    if (report.resolved.without_mesh) {
        const StreamedMesh made = measure_surface(surface, 0, run);
        report.mesh.triangles = std::int64_t(made.triangles);
        report.surface = made.measures;
        if (!s.marks.empty()) report.fit = measure_fit(s.marks, surface, run);
        return;
    }
    TriangleMesh& mesh = s.result.mesh;
    mesh = extract_mesh(surface, extract, run);
    report.mesh = relax_mesh(mesh, surface, {extract.isovalue}, run);
    report.surface = measure(mesh);
    if (!s.marks.empty()) report.fit = measure_fit(s.marks, mesh, run);
}

/// What changed by the separation is measured again.
void separate_all(StructuresOutput& output, const SegmentOptions& options, const RunContext& run) {
    const SeparateResult separated = separate(solids(output), {}, run);
    for (const StructureOverlap& overlap : separated.report.overlaps) {
        Json entry{{"structures", {output.structures[overlap.a].name, output.structures[overlap.b].name}},
                   {"volume", overlap.volume}};
        if (overlap.inner) entry["inner"] = output.structures[*overlap.inner].name;
        output.overlaps.push_back(entry);
    }
    for (std::size_t n = 0; n < output.structures.size(); ++n) {
        if (!separated.report.changed[n]) continue;
        StructureOutput& s = output.structures[n];
        s.result.surface = separated.surfaces[n];
        measure_again(s, options.extract, run);
        SegmentReport& report = s.result.report;
        report.seeds = check_seeds(*s.result.surface, report.resolved.inside, report.resolved.outside);
    }
}

void add_seconds(Session& session, const SegmentReport::Seconds& seconds) {
    session.add_seconds("distance", seconds.distance);
    session.add_seconds("tag", seconds.tag);
    session.add_seconds("coarse", seconds.coarse);
    session.add_seconds("edge", seconds.edge);
    session.add_seconds("solve", seconds.solve);
    session.add_seconds("surface", seconds.surface);
}

/// What a failed run had goes to --keep-failed at once, and stays.
void keep_failed(const SegmentJob& job, const StructureOutput& s, const SegmentFailed& failed, Session& session) {
    const std::string path = s.name.empty() ? job.failed_path : with_suffix(job.failed_path, "_" + s.grid);
    std::vector<FloatGridPtr> grids;
    const auto add = [&](const FloatGridPtr& grid, const char* name) {
        if (!grid) return;
        grids.push_back(grid->deepCopy());
        grids.back()->setName(name);
    };
    add(failed.start, "start");
    add(failed.u, "u");
    add(failed.distance, "distance");
    add(failed.edge, "edge");
    std::map<std::string, std::string> metadata = session.metadata();
    metadata["covol_failed"] = failed.what();
    if (session.outputs().write(path, [&](const std::string& file) { write_vdb(file, grids, job.vdb.with(metadata)); }))
        session.note("kept " + path);
}

void summarise_in_table(const StructuresOutput& output, const SegmentJob& job, Session& session) {
    const auto number = [](double value) {
        std::ostringstream text;
        text << std::setprecision(4) << value;
        return text.str();
    };
    std::vector<std::vector<std::string>> rows{
        {"structure", "volume", "area", "pieces", "genus", "marks", "off: mean", "95 %", "max", "steps", "seconds"}};
    std::string unused;
    for (const StructureOutput& s : output.structures) {
        const SegmentReport& r = s.result.report;
        const bool has_marks = r.point_count > 0;
        const auto fit = [&](double value) { return has_marks ? number(value) : "-"; };
        rows.push_back(
            {s.shown_name(), number(r.surface.volume), number(r.surface.area), std::to_string(r.surface.components),
             r.surface.closed ? std::to_string(r.surface.genus) : "open", std::to_string(r.point_count),
             fit(r.fit.mean), fit(r.fit.p95), fit(r.fit.max), std::to_string(r.solve.steps), number(r.seconds.total)});
        if (const std::string line = job.unused(r); !line.empty()) unused = line;
        if (s.evidence) tell(session, *s.evidence, s.shown_name() + ": ");
    }
    for (const std::string& line : aligned(rows)) session.note(line);
    if (!unused.empty()) session.warn(unused);
}

void summarise(const StructuresOutput& output, const SegmentJob& job, Session& session) {
    if (output.structures.size() > kMostInLines) return summarise_in_table(output, job, session);
    for (const StructureOutput& s : output.structures) {
        const std::string who = s.name.empty() ? "" : s.name + ": ";
        for (const std::string& line : summary(s.result.report)) session.note(who + line);
        if (const std::string line = job.unused(s.result.report); !line.empty()) session.warn(who + line);
        if (s.evidence) tell(session, *s.evidence, who);
    }
}

}  // namespace

StructurePreparer::StructurePreparer(const SegmentJob& job, const std::vector<StructureInput>& inputs,
                                     const Image* image, const std::vector<StructureStart>& starts, Session& session)
    : job_(job),
      inputs_(inputs),
      image_(image),
      starts_(starts),
      session_(session),
      geometry_(image != nullptr ? image->geometry() : ImageGeometry{}),
      grids_(make_grid_names(names_of(inputs))),
      paint_(job, geometry_) {}

PreparedStructure StructurePreparer::prepare(std::size_t n, const RunContext& run) {
    PreparedStructure prepared = read_marks_of(n, run);
    add_guess(n, prepared, run);
    return prepared;
}

void StructurePreparer::add_guess(std::size_t n, PreparedStructure& prepared, const RunContext& run) const {
    const StructureInput& input = inputs_[n];
    if (input.guess.empty()) return;
    prepared.guess =
        read_guess(input.guess, job_.guess.inputs.options.guess_label, geometry_, job_.image.has("spacing"), run);
    prepared.options.guess = prepared.guess->start;
    prepared.output.input["guess"] = {{"path", input.guess}, {"label", prepared.guess->label}};
}

PreparedStructure StructurePreparer::read_marks_of(std::size_t n, const RunContext& run) {
    const ImageGeometry* const geometry = image_ != nullptr ? &geometry_ : nullptr;
    const StructureInput& input = inputs_[n];
    PreparedStructure prepared;
    StructureOutput& s = prepared.output;
    s.name = input.name;
    s.grid = grids_[n];
    s.label = input.label;
    const Stopwatch reading;
    Marks marks = read_marks(input.points, input.contours, job_.cloud, geometry, run);
    session_.add_seconds("read", reading.seconds());
    if (image_ == nullptr && marks.given.empty()) throw UsageError("expected an image, points or contours, got none");
    if (!voxel_size_) voxel_size_ = job_.resolve_voxel_size(image_, marks, session_);
    const double h = *voxel_size_;
    const std::shared_ptr<const Contours> painted = paint_.own_contours(input, marks, h, run);
    if (!painted) paint_.add_outlines(input, marks, run);
    prepare_marks(marks, job_.cloud, input.contours, geometry, h, session_, run);
    if (painted) {
        marks.contours = painted;
        marks.given.insert(marks.given.end(), painted->marks.begin(), painted->marks.end());
        marks.report["points"]["count"] = marks.given.size();
    }
    s.marks = marks.given;
    s.input = marks.report;
    if (!input.paint.empty()) s.input["painted"] = paint_.report(input, run);
    SegmentOptions& options = prepared.options = job_.resolve(h);
    check_tag_distance(options.tag_distance.value_or(0), marks.given);
    options.contours = marks.contours;
    options.hints = marks.hints;
    Seeds seeds = read_seeds(input.seeds, input.points.options, geometry, h, run);
    options.inside = std::move(seeds.inside);
    options.outside = std::move(seeds.outside);
    paint_.add_seeds(inputs_, n, options, run);
    options.exterior_seeds = input.exterior_seeds;
    options.start = starts_[n].start;
    if (!options.evolve.delta) options.evolve.delta = starts_[n].delta;
    prepared.points = std::move(marks.points);
    return prepared;
}

SegmentResult solve_in_one_piece(const Image* image, const PreparedStructure& structure, const RunContext& run) {
    return image != nullptr ? segment(*image, structure.points, structure.options, run)
                            : reconstruct(structure.points, structure.options, run);
}

StructuresOutput segment_structures(const SegmentJob& job, const std::vector<StructureInput>& inputs,
                                    const Image* image, const std::vector<StructureStart>& starts, Session& session,
                                    const RunContext& run, const Solver& solve) {
    StructuresOutput output;
    if (image != nullptr) output.geometry = image->geometry();
    if (image != nullptr && !job.page_path.empty()) {
        output.image = *image;
        output.is_anatomical = is_anatomical(image->path(), job.image.options, run);
    }
    StructurePreparer preparer(job, inputs, image, starts, session);
    const auto speaking = [&](std::size_t n) {
        return speaking_for(inputs[n].name, inputs.size() > kMostInLines, run);
    };
    // All marks before the first is solved: what is wrong with the last file is told at once.
    std::vector<PreparedStructure> structures;
    for (std::size_t n = 0; n < inputs.size(); ++n) structures.push_back(preparer.read_marks_of(n, speaking(n)));
    for (std::size_t n = 0; n < inputs.size(); ++n) {
        const RunContext own = speaking(n);
        PreparedStructure prepared = std::move(structures[n]);
        preparer.add_guess(n, prepared, own);
        StructureOutput& s = prepared.output;
        try {
            s.result = solve(image, prepared, own);
        } catch (const SegmentFailed& failed) {
            keep_failed(job, s, failed, session);
            throw Error(failed.code(), (s.name.empty() ? "" : s.name + ": ") + failed.what());
        } catch (const Error& error) {
            if (s.name.empty()) throw;
            throw Error(error.code(), s.name + ": " + error.what());
        }
        s.input["points"]["densified"] = s.result.report.densified;
        const std::optional<Guess>& guess = prepared.guess;
        if (guess && guess->mask && inputs.size() == 1) {
            s.label = guess->label;
            if (!job.mask_path.empty() && is_same_lattice(guess->mask->geometry(), output.geometry))
                s.corrected = s.result.correction->apply(*guess->mask, guess->label, own);
            else if (!job.mask_path.empty())
                own.warn("--guess: " + inputs[n].guess +
                         " does not lie on the image's voxels; the mask is made from the corrected surface");
        }
        add_seconds(session, s.result.report.seconds);
        output.structures.push_back(std::move(s));
    }
    if (inputs.size() > 1) {
        const Stopwatch separating;
        separate_all(output, job.resolve(preparer.voxel_size()), run);
        session.add_seconds("separate", separating.seconds());
    }
    for (StructureOutput& s : output.structures) {
        s.result.surface->setName(s.grid);
        if (image != nullptr && job.evidence.wanted()) s.evidence = job.evidence.judge(s.result, s.marks, *image, run);
    }
    summarise(output, job, session);
    return output;
}

void run_structures(const SegmentJob& job, Session& session, const Solver& solve) {
    Outputs& outputs = session.outputs();
    const std::vector<StructureInput> inputs = structures_of(job, job.painted.read(session.run()));
    check_outputs(job, inputs, {}, outputs);
    check_scene(job, outputs);
    outputs.check("--table", job.table_path, OutputKind::Table);
    job.check_options();

    const std::vector<StructureStart> starts = starts_of(job, inputs);
    ReadImageOptions reading = job.image.options;
    if (job.frames.given) reading.frame = job.frames.first;
    std::optional<Image> image;
    if (!job.images.empty()) image = job.read(job.images.front(), reading, session);
    const auto output = std::make_shared<StructuresOutput>(
        segment_structures(job, inputs, image ? &*image : nullptr, starts, session, session.run(), solve));
    session.report().update(to_json(*output), true);
    if (image) SegmentJob::tell_chunks(*image, session);
    hand_over(job, output, {}, session,
              [&](const std::string& path, auto write) { outputs.add(path, std::move(write)); });
    UsdScene scene;
    add_to_scene(scene, job, *output, {});
    write_scene(scene, job, session);
    outputs.add(job.table_path, [output, &session](const std::string& file) {
        Table table(result_columns());
        for (const StructureOutput& s : output->structures)
            add_result(table.row(), s.name.empty() ? s.grid : s.name, s.label, s.result.report);
        write_text(file, table.text(), session.run());
    });
}

}  // namespace covol::tool
