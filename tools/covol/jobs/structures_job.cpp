#include "jobs/structures_job.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "cli/report.h"
#include "covol/error.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"
#include "jobs/marks.h"

namespace covol::tool {
namespace {

StructureInput& find_or_add(std::vector<StructureInput>& inputs, const std::string& name, const SegmentJob& job) {
    for (StructureInput& input : inputs)
        if (input.name == name) return input;
    StructureInput added;
    added.name = name;
    added.points = job.points;
    added.points.paths.clear();
    added.contours = job.contours;
    added.contours.paths.clear();
    added.seeds = {};
    inputs.push_back(added);
    return inputs.back();
}

/// A context whose lines begin with the structure's name.
RunContext speaking_for(const std::string& name, const RunContext& run) {
    RunContext named = run;
    if (!name.empty() && run.log)
        named.log = [log = run.log, name](LogLevel level, const std::string& line) { log(level, name + ": " + line); };
    return named;
}

std::vector<Structure> solids(const StructuresOutput& output) {
    std::vector<Structure> result;
    for (const StructureOutput& s : output.structures) result.push_back({s.name, s.result.surface});
    return result;
}

bool is_nrrd(const std::string& path) { return path.ends_with(".nrrd") || path.ends_with(".NRRD"); }

/// Up to rounding in files.
bool is_same_lattice(const ImageGeometry& a, const ImageGeometry& b) {
    if (a.size != b.size) return false;
    const double slack = 1e-3 * *std::min_element(b.spacing.begin(), b.spacing.end());
    for (const Vec3& corner : {Vec3{0, 0, 0}, Vec3{double(a.size[0]), 0, 0}, Vec3{0, double(a.size[1]), 0}, Vec3{0, 0, double(a.size[2])}}) {
        const Vec3 p = a.index_to_world(corner), q = b.index_to_world(corner);
        if (std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) > slack) return false;
    }
    return true;
}

std::string labels_path(const std::string& mask) {
    return std::filesystem::path(with_suffix(mask, "_labels")).replace_extension(".txt").string();
}

/// What changed by the separation is measured again.
void separate_all(StructuresOutput& output, const SegmentOptions& options, const RunContext& run) {
    if (output.structures.size() < 2) return;
    const SeparateResult separated = separate(solids(output), {}, run);
    for (const StructureOverlap& overlap : separated.report.overlaps) {
        Json entry{{"structures", {output.structures[overlap.a].name, output.structures[overlap.b].name}}, {"volume", overlap.volume}};
        if (overlap.inner) entry["inner"] = output.structures[*overlap.inner].name;
        output.overlaps.push_back(entry);
    }
    for (std::size_t n = 0; n < output.structures.size(); ++n) {
        if (!separated.report.changed[n]) continue;
        StructureOutput& s = output.structures[n];
        s.result.surface = separated.surfaces[n];
        s.result.mesh = extract_mesh(*s.result.surface, options.extract, run);
        s.result.report.mesh = relax_mesh(s.result.mesh, *s.result.surface, {options.extract.isovalue}, run);
        s.result.report.surface = measure(s.result.mesh);
        if (!s.marks.empty()) s.result.report.fit = points_to_surface(s.marks, s.result.mesh, run);
        SegmentReport& report = s.result.report;
        report.seeds = check_seeds(*s.result.surface, report.resolved.inside, report.resolved.outside);
    }
}

void summarise(const StructuresOutput& output, Session& session) {
    for (const StructureOutput& s : output.structures) {
        const std::string who = s.name.empty() ? "" : s.name + ": ";
        for (const std::string& line : summary(s.result.report)) session.note(who + line);
        if (s.evidence) tell(session, *s.evidence, who);
    }
}

FloatGridPtr named(FloatGridPtr grid, const std::string& name) {
    grid->setName(name);
    return grid;
}

/// u, distance and edge of each structure; with several, "u_ve" and so on.
std::vector<FloatGridPtr> fields_of(const StructuresOutput& output) {
    std::vector<FloatGridPtr> grids;
    for (const StructureOutput& s : output.structures) {
        const std::string end = output.structures.size() > 1 ? "_" + s.grid : "";
        grids.push_back(named(s.result.u, "u" + end));
        if (s.result.distance) grids.push_back(named(s.result.distance, "distance" + end));
        if (s.result.edge) grids.push_back(named(s.result.edge, "edge" + end));
    }
    return grids;
}

std::map<std::string, std::string> metadata_of(const StructuresOutput& output, const Session& session) {
    Json resolved = Json::object();
    for (const StructureOutput& s : output.structures) {
        const Json used = to_json(s.result.report.resolved);
        if (s.name.empty())
            resolved = used;
        else
            resolved[s.name] = used;
    }
    std::map<std::string, std::string> metadata = session.metadata();
    metadata["covol_resolved"] = resolved.dump(-1, ' ', false, Json::error_handler_t::replace);
    return metadata;
}

void hand_over_meshes(const SegmentJob& job, const std::shared_ptr<const StructuresOutput>& output, const std::string& path,
                      const Session& session, const Sink& sink) {
    if (path.empty()) return;
    const WriteMeshOptions options = job.mesh.options(session);
    if (output->structures.size() > 1 && holds_several_meshes(path)) {
        sink(path, [output, options](const std::string& file) {
            std::vector<NamedMesh> meshes;
            for (const StructureOutput& s : output->structures)
                meshes.push_back({s.name, s.result.mesh, structure_color(meshes.size())});
            write_meshes(file, meshes, options);
        });
        return;
    }
    for (std::size_t n = 0; n < output->structures.size(); ++n)
        sink(output->structures.size() > 1 ? with_suffix(path, "_" + output->structures[n].grid) : path,
             [output, n, options](const std::string& file) {
                 WriteMeshOptions with_evidence = options;
                 with_evidence.attributes = vertex_attributes(output->structures[n].evidence);
                 write_mesh(file, output->structures[n].result.mesh, with_evidence);
             });
}

/// Bytes where they hold all values.
void write_labels(const std::string& file, const ImageGeometry& geometry, const std::vector<std::int32_t>& values,
                  const std::vector<std::pair<std::string, std::string>>& metadata) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    if (*low < 0 || *high > 255) return write_image(file, geometry, values.data(), metadata);
    const std::vector<std::uint8_t> bytes(values.begin(), values.end());
    write_image(file, geometry, bytes.data(), metadata);
}

void hand_over_labels(const std::shared_ptr<const StructuresOutput>& output, const std::string& path, const RunContext& run,
                      const Sink& sink) {
    if (path.empty()) return;
    const bool has_names = !output->structures.front().name.empty();
    sink(path, [output, run, has_names](const std::string& file) {
        const std::vector<int> label_of = output->labels();
        if (const StructureOutput& only = output->structures.front(); output->structures.size() == 1 && only.corrected) {
            std::vector<std::pair<std::string, std::string>> segments;
            std::vector<std::uint8_t> own;
            for (const std::int32_t value : only.corrected->values) own.push_back(value == only.label ? 1 : 0);
            if (has_names) segments = slicer_segments(output->names(), own, output->geometry.size, label_of);
            return write_labels(file, output->geometry, only.corrected->values, segments);
        }
        const std::vector<std::uint8_t> labels = label_image(solids(*output), output->geometry, run);
        std::vector<std::int32_t> values(labels.begin(), labels.end());
        for (std::int32_t& value : values)
            if (value > 0) value = label_of[std::size_t(value) - 1];
        write_labels(file, output->geometry, values,
                     has_names ? slicer_segments(output->names(), labels, output->geometry.size, label_of)
                               : std::vector<std::pair<std::string, std::string>>{});
    });
    if (has_names && !is_nrrd(path))
        sink(labels_path(path), [output](const std::string& file) { write_text(file, itksnap_labels(output->names(), output->labels())); });
}

Json report_of(const StructureOutput& s) {
    Json json{{"input", s.input}};
    json.update(to_json(s.result.report));
    if (s.result.correction) json["correction"] = to_json(s.result.report.correction);
    if (s.corrected)
        json["correction"]["mask"] = {{"added", s.corrected->added}, {"removed", s.corrected->removed}, {"reached", s.corrected->reached}};
    if (s.evidence) json["evidence"] = to_json(*s.evidence);
    return json;
}

/// Painted labels keep their values; the others get what is free.
void number_labels(std::vector<StructureInput>& inputs) {
    std::set<int> taken;
    for (StructureInput& input : inputs)
        for (const StructureInput::Paint& paint : input.paint)
            if (input.label == 0 && taken.insert(paint.label).second) input.label = paint.label;
    int next = 1;
    for (StructureInput& input : inputs) {
        while (taken.contains(next)) ++next;
        if (input.label == 0) taken.insert(input.label = next);
    }
}

/// The structure that a text NAME=... belongs to.
StructureInput& owner_of(std::vector<StructureInput>& inputs, const std::string& flag, const std::string& name) {
    const auto at = std::find_if(inputs.begin(), inputs.end(), [&](const StructureInput& input) { return input.name == name; });
    if (at == inputs.end()) throw UsageError(flag + ": no structure is called '" + name + "'");
    return *at;
}

/// Gives each seed to its structure; one without a name to all.
void share_seeds(std::vector<StructureInput>& inputs, const std::string& flag, const std::vector<std::string>& texts,
                 std::vector<std::string> SeedFlags::*side) {
    for (const std::string& text : texts) {
        const Named seed = split_name(text);
        if (!seed.name.empty())
            (owner_of(inputs, flag, seed.name).seeds.*side).push_back(seed.value);
        else
            for (StructureInput& input : inputs) (input.seeds.*side).push_back(seed.value);
    }
}

void add_paint(std::vector<StructureInput>& inputs, const std::vector<std::shared_ptr<const PaintedFile>>& painted, const SegmentJob& job) {
    std::size_t labels = 0;
    bool named = false;
    for (const auto& file : painted) {
        labels += file->labels.size();
        named = named || !file->name.empty();
    }
    const bool one = labels == 1 && !named && (inputs.size() == 1 ? inputs.front().name.empty() : inputs.empty() && !painted.front()->labels.front().named);
    for (const auto& file : painted)
        for (const LabelName& label : file->labels) find_or_add(inputs, one ? "" : label.name, job).paint.push_back({file, label.label});
}

/// Paint as marks: outlines of whole slices, and seeds. Paint of one structure is outside of the others.
class PaintReader {
public:
    PaintReader(const SegmentJob& job, const ImageGeometry& image) : job_(job), image_(image) {}

    /// What every file says; once for each.
    const Painted& of(const StructureInput::Paint& paint, const RunContext& run) {
        const auto known = files_.find(paint.file.get());
        if (known != files_.end()) return known->second;
        const bool force = job_.image.options.spacing[0] > 0;
        return files_.emplace(paint.file.get(), job_.painted.understand(*paint.file, image_, force, run)).first->second;
    }
    const PaintedLabel& label_of(const StructureInput::Paint& paint, const RunContext& run) {
        for (const PaintedLabel& label : of(paint, run).labels)
            if (label.label == paint.label) return label;
        throw Error(Errc::InvalidInput, "--painted: " + paint.file->path + ": label " + std::to_string(paint.label) + " is not there");
    }
    /// Outlines in the world, to be joined with contours from files.
    void add_outlines(const StructureInput& input, Marks& marks, const RunContext& run) {
        for (const StructureInput::Paint& paint : input.paint)
            for (const PaintedView& view : label_of(paint, run).views) {
                PointCloud outlines = view.outlines;
                outlines.points = to_world(outlines, &of(paint, run).geometry);
                outlines.space = PointSpace::World;
                marks.drawn.push_back(std::move(outlines));
            }
    }
    /// The only view of the only file, which needs no common lattice; or null.
    std::shared_ptr<const Contours> own_contours(const StructureInput& input, const Marks& marks, double h, const RunContext& run) {
        if (input.paint.size() != 1 || !marks.drawn.empty()) return nullptr;
        const PaintedLabel& label = label_of(input.paint.front(), run);
        if (label.views.empty()) return nullptr;
        auto contours = std::make_shared<Contours>(contours_of(label, of(input.paint.front(), run).geometry, h, run));
        run.info("painted: " + contours->summary);
        return contours;
    }
    void add_seeds(const std::vector<StructureInput>& inputs, std::size_t own, SegmentOptions& options, const RunContext& run) {
        for (std::size_t n = 0; n < inputs.size(); ++n)
            for (const StructureInput::Paint& paint : inputs[n].paint) {
                const std::vector<Vec3>& seeds = label_of(paint, run).inside;
                std::vector<Vec3>& side = n == own ? options.inside : options.outside;
                side.insert(side.end(), seeds.begin(), seeds.end());
            }
        std::set<const PaintedFile*> done;
        for (const StructureInput& input : inputs)
            for (const StructureInput::Paint& paint : input.paint)
                if (done.insert(paint.file.get()).second) {
                    const std::vector<Vec3>& outside = of(paint, run).outside;
                    options.outside.insert(options.outside.end(), outside.begin(), outside.end());
                }
    }
    Json report(const StructureInput& input, const RunContext& run) {
        Json list = Json::array();
        for (const StructureInput::Paint& paint : input.paint) {
            Json entry = to_json(label_of(paint, run));
            entry["path"] = paint.file->path;
            list.push_back(entry);
        }
        return list;
    }

private:
    const SegmentJob& job_;
    const ImageGeometry& image_;
    std::map<const PaintedFile*, Painted> files_;
};

}  // namespace

std::vector<std::string> StructuresOutput::names() const {
    std::vector<std::string> result;
    for (const StructureOutput& s : structures) result.push_back(s.name);
    return result;
}

std::string with_suffix(const std::string& path, const std::string& suffix) {
    const std::filesystem::path whole(path);
    std::string name = whole.filename().string();
    std::size_t dot = name.rfind('.');
    if (dot == std::string::npos || dot == 0) return path + suffix;
    for (const char* end : {".nii.gz", ".seg.nrrd"})
        if (name.size() > std::string(end).size() && name.ends_with(end)) dot = name.size() - std::string(end).size();
    return (whole.parent_path() / name.insert(dot, suffix)).string();
}

std::vector<int> StructuresOutput::labels() const {
    std::vector<int> result;
    for (const StructureOutput& s : structures) result.push_back(s.label);
    return result;
}

std::vector<StructureInput> structures_of(const SegmentJob& job, const std::vector<std::shared_ptr<const PaintedFile>>& painted) {
    std::vector<StructureInput> inputs;
    for (const std::string& text : job.points.paths) {
        const Named file = split_name(text);
        find_or_add(inputs, file.name, job).points.paths.push_back(file.value);
    }
    for (const std::string& text : job.contours.paths) {
        const Named file = split_name(text);
        find_or_add(inputs, file.name, job).contours.paths.push_back(file.value);
    }
    add_paint(inputs, painted, job);
    for (const std::string& text : job.guess.paths) {
        const Named file = split_name(text);
        StructureInput& input = find_or_add(inputs, file.name, job);
        if (!input.guess.empty()) throw UsageError("--guess: expected one file for a structure, got " + input.guess + " and " + file.value);
        input.guess = file.value;
    }
    for (const std::string& text : job.seeds.inside)
        if (const Named seed = split_name(text); !seed.name.empty()) find_or_add(inputs, seed.name, job);
    if (inputs.empty()) find_or_add(inputs, "", job);
    for (const StructureInput& input : inputs)
        if (inputs.size() > 1 && input.name.empty()) {
            const std::string first = !input.points.paths.empty()     ? input.points.paths.front()
                                      : !input.contours.paths.empty() ? input.contours.paths.front()
                                                                      : input.guess;
            throw UsageError("--points, --contours: expected a name for every file when one has a name (ve=FILE) or several "
                             "labels are painted, got none for " + first);
        }
    share_seeds(inputs, "--inside", job.seeds.inside, &SeedFlags::inside);
    share_seeds(inputs, "--outside", job.seeds.outside, &SeedFlags::outside);
    number_labels(inputs);
    for (StructureInput& input : inputs) input.exterior_seeds = job.tag.exterior_seeds;
    for (const auto& [name, seed] : job.tag.named_seeds) {
        const auto at = std::find_if(inputs.begin(), inputs.end(), [&, &who = name](const auto& i) { return i.name == who; });
        if (at == inputs.end()) throw UsageError("--exterior-seed: no structure is called '" + name + "'");
        at->exterior_seeds.push_back(seed);
    }
    return inputs;
}

std::vector<StructureStart> starts_of(const SegmentJob& job, const std::vector<StructureInput>& inputs) {
    std::vector<StructureStart> starts(inputs.size(), {job.start});
    if (inputs.size() == 1 || job.start.kind <= Start::Kind::Tag) return starts;
    if (job.start.kind != Start::Kind::Vdb)
        throw UsageError("--init: several structures cannot start from one shape; expected tag, or vdb:FILE with a grid for each");
    std::vector<std::string> names;
    for (const StructureInput& input : inputs) names.push_back(input.name);
    const std::vector<std::string> grids = grid_names(names);
    for (std::size_t n = 0; n < starts.size(); ++n) starts[n].start.level_set = read_vdb(job.start.path, grids[n]);
    return starts;
}

StructuresOutput segment_structures(const SegmentJob& job, const std::vector<StructureInput>& inputs, const Image& image,
                                    const std::vector<StructureStart>& starts, Session& session, const RunContext& run) {
    StructuresOutput output;
    output.geometry = image.geometry();
    const double h = job.domain.resolve_voxel_size(&image, {}, session);
    const SegmentOptions given = job.resolve(h);
    std::vector<std::string> names;
    for (const StructureInput& input : inputs) names.push_back(input.name);
    const std::vector<std::string> grids = grid_names(names);
    PaintReader paint(job, output.geometry);
    const bool force = job.image.options.spacing[0] > 0;
    for (std::size_t n = 0; n < inputs.size(); ++n) {
        const RunContext own = speaking_for(inputs[n].name, run);
        StructureOutput s;
        s.name = inputs[n].name;
        s.grid = grids[n];
        s.label = inputs[n].label;
        Marks marks = read_marks(inputs[n].points, inputs[n].contours, job.cloud, &image.geometry(), own);
        const std::shared_ptr<const Contours> painted = paint.own_contours(inputs[n], marks, h, own);
        if (!painted) paint.add_outlines(inputs[n], marks, own);
        prepare(marks, job.cloud, inputs[n].contours, &image.geometry(), h, session, own);
        if (painted) {
            marks.contours = painted;
            marks.given.insert(marks.given.end(), painted->marks.begin(), painted->marks.end());
            marks.report["points"]["count"] = marks.given.size();
        }
        s.marks = marks.given;
        s.input = marks.report;
        if (!inputs[n].paint.empty()) s.input["painted"] = paint.report(inputs[n], own);
        SegmentOptions options = given;
        options.contours = marks.contours;
        Seeds seeds = read_seeds(inputs[n].seeds, inputs[n].points.options, &image.geometry(), h, own);
        options.inside = std::move(seeds.inside);
        options.outside = std::move(seeds.outside);
        paint.add_seeds(inputs, n, options, own);
        std::optional<Guess> guess;
        if (!inputs[n].guess.empty()) {
            guess = read_guess(inputs[n].guess, job.guess.label, image.geometry(), force, own);
            options.guess = guess->start;
            s.input["guess"] = {{"path", inputs[n].guess}, {"label", guess->label}};
        }
        options.exterior_seeds = inputs[n].exterior_seeds;
        options.start = starts[n].start;
        if (options.evolve.delta < 0) options.evolve.delta = starts[n].delta;
        try {
            s.result = segment(&image, marks.points, options, own);
        } catch (const Error& error) {
            if (s.name.empty()) throw;
            throw Error(error.code(), s.name + ": " + error.what());
        }
        s.input["points"]["densified"] = s.result.report.densified;
        if (guess && guess->mask && inputs.size() == 1) {
            s.label = guess->label;
            if (!job.mask_path.empty() && is_same_lattice(guess->mask->geometry(), image.geometry()))
                s.corrected = s.result.correction->apply(*guess->mask, guess->label, own);
            else if (!job.mask_path.empty())
                own.warn("--guess: " + inputs[n].guess + " does not lie on the image's voxels; the mask is made from the corrected surface");
        }
        add_seconds(session, s.result.report.seconds);
        output.structures.push_back(std::move(s));
    }
    const Stopwatch separating;
    separate_all(output, given, run);
    session.add_seconds("separate", separating.seconds());
    for (StructureOutput& s : output.structures) {
        s.result.surface->setName(s.grid);
        if (job.evidence.wanted()) s.evidence = job.evidence.judge(s.result, s.marks, image, run);
        if (job.evolve.strict && s.result.report.solve.stop_reason != StopReason::Steady) session.set_exit_code(kNotSteady);
    }
    session.add_seconds("total", separating.seconds());
    summarise(output, session);
    for (const StructureOutput& one : output.structures)
        if (const std::string line = job.unused(one.result.report); !line.empty()) session.warn((one.name.empty() ? "" : one.name + ": ") + line);
    return output;
}

void check_outputs(const SegmentJob& job, const std::vector<StructureInput>& inputs, const std::string& tag, Outputs& outputs) {
    const auto tagged = [&](const std::string& path) { return path.empty() ? path : with_suffix(path, tag); };
    outputs.check("-o", tagged(job.output), OutputKind::Vdb);
    outputs.check("--mask", tagged(job.mask_path), OutputKind::Image);
    if (!job.mask_path.empty() && !inputs.front().name.empty() && !is_nrrd(job.mask_path))
        outputs.check("--mask", labels_path(tagged(job.mask_path)), OutputKind::Text);
    outputs.check("--density", tagged(job.density_path), OutputKind::Vdb);
    outputs.check("--fields", tagged(job.fields_path), OutputKind::Vdb);
    job.evidence.check(outputs, tagged(job.evidence.path));
    job.mesh.check();
    const std::string mesh = tagged(job.mesh_path);
    if (inputs.size() == 1 || mesh.empty() || holds_several_meshes(mesh)) return outputs.check("--mesh", mesh, OutputKind::Mesh);
    std::vector<std::string> names;
    for (const StructureInput& input : inputs) names.push_back(input.name);
    for (const std::string& grid : grid_names(names)) outputs.check("--mesh", with_suffix(mesh, "_" + grid), OutputKind::Mesh);
}

void hand_over(const SegmentJob& job, const std::shared_ptr<const StructuresOutput>& output, const std::string& tag,
               Session& session, const Sink& sink) {
    const auto tagged = [&](const std::string& path) { return path.empty() ? path : with_suffix(path, tag); };
    const WriteVdbOptions vdb{job.half, metadata_of(*output, session)};
    sink(tagged(job.output), [output, vdb](const std::string& file) {
        std::vector<FloatGridPtr> grids;
        for (const StructureOutput& s : output->structures) grids.push_back(s.result.surface);
        write_vdb(file, grids, vdb);
    });
    sink(tagged(job.density_path), [output, vdb](const std::string& file) {
        std::vector<FloatGridPtr> grids;
        for (const StructureOutput& s : output->structures)
            grids.push_back(named(density(*s.result.surface), output->structures.size() > 1 ? "density_" + s.grid : "density"));
        write_vdb(file, grids, vdb);
    });
    sink(tagged(job.fields_path), [output, vdb](const std::string& file) { write_vdb(file, fields_of(*output), vdb); });
    hand_over_meshes(job, output, tagged(job.mesh_path), session, sink);
    hand_over_labels(output, tagged(job.mask_path), session.run(), sink);
    sink(tagged(job.evidence.path), [output](const std::string& file) {
        std::vector<EvidenceOf> surfaces;
        for (const StructureOutput& s : output->structures) surfaces.push_back({s.name.empty() ? s.grid : s.name, &*s.evidence});
        write_text(file, evidence_csv(surfaces));
    });
}

Json to_json(const StructuresOutput& output) {
    if (output.structures.size() == 1 && output.structures.front().name.empty()) return report_of(output.structures.front());
    Json list = Json::array();
    for (const StructureOutput& s : output.structures) {
        const auto color = structure_color(list.size());
        Json entry{{"name", s.name}, {"label", s.label}, {"color", color}, {"vdb_grid", s.grid}};
        entry.update(report_of(s));
        list.push_back(entry);
    }
    return {{"structures", list}, {"overlaps", output.overlaps}};
}

std::vector<std::string> result_columns() {
    return {"structure", "label", "volume", "area", "components", "genus", "closed", "fit_mean", "fit_p95", "fit_max",
            "steps", "stop_reason", "seconds"};
}

void add_result(Table& table, const std::string& name, int label, const SegmentReport& r) {
    table << name << label << r.surface.volume << r.surface.area << r.surface.components << r.surface.genus
          << (r.surface.closed ? "true" : "false");
    if (r.point_count > 0)
        table << r.fit.mean << r.fit.p95 << r.fit.max;
    else
        table << "" << "" << "";
    table << r.solve.steps << to_string(r.solve.stop_reason) << r.seconds.total;
}

void run_structures(const SegmentJob& job, Session& session) {
    Outputs& outputs = session.outputs();
    const std::vector<StructureInput> inputs = structures_of(job, job.painted.read(session.run()));
    check_outputs(job, inputs, "", outputs);
    outputs.check("--table", job.table_path, OutputKind::Table);
    job.check_options();

    const std::vector<StructureStart> starts = starts_of(job, inputs);
    ReadImageOptions reading = job.image.options;
    if (job.frames.given) reading.frame = job.frames.first;
    const Image image = job.read(job.images.front(), reading, session);
    const auto output =
        std::make_shared<StructuresOutput>(segment_structures(job, inputs, image, starts, session, session.run()));
    session.report().update(to_json(*output), true);
    hand_over(job, output, "", session, [&](const std::string& path, auto write) { outputs.add(path, std::move(write)); });
    outputs.add(job.table_path, [output](const std::string& file) {
        Table table(result_columns());
        for (const StructureOutput& s : output->structures) add_result(table.row(), s.name.empty() ? s.grid : s.name, s.label, s.result.report);
        write_text(file, table.text());
    });
}

}  // namespace covol::tool
