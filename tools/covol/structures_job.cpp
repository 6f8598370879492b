#include "structures_job.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <filesystem>

#include "covol/error.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"
#include "marks.h"
#include "report.h"

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
        s.result.report.surface = measure(s.result.mesh);
        if (!s.marks.empty()) s.result.report.fit = points_to_surface(s.marks, s.result.mesh, run);
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

void hand_over_labels(const std::shared_ptr<const StructuresOutput>& output, const std::string& path, const RunContext& run,
                      const Sink& sink) {
    if (path.empty()) return;
    const bool has_names = !output->structures.front().name.empty();
    sink(path, [output, run, has_names](const std::string& file) {
        const std::vector<std::uint8_t> labels = label_image(solids(*output), output->geometry, run);
        if (has_names)
            write_image(file, output->geometry, labels.data(), slicer_segments(output->names(), labels, output->geometry.size));
        else
            write_image(file, output->geometry, labels.data());
    });
    if (has_names && !is_nrrd(path))
        sink(labels_path(path), [output](const std::string& file) { write_text(file, itksnap_labels(output->names())); });
}

Json report_of(const StructureOutput& s) {
    Json json{{"input", s.input}};
    json.update(to_json(s.result.report));
    if (s.evidence) json["evidence"] = to_json(*s.evidence);
    return json;
}

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

std::vector<StructureInput> structures_of(const SegmentJob& job) {
    std::vector<StructureInput> inputs;
    for (const std::string& text : job.points.paths) {
        const Named file = split_name(text);
        find_or_add(inputs, file.name, job).points.paths.push_back(file.value);
    }
    for (const std::string& text : job.contours.paths) {
        const Named file = split_name(text);
        find_or_add(inputs, file.name, job).contours.paths.push_back(file.value);
    }
    if (inputs.empty()) find_or_add(inputs, "", job);
    for (const StructureInput& input : inputs)
        if (inputs.size() > 1 && input.name.empty())
            throw UsageError("--points, --contours: expected a name for every file when one has a name (ve=FILE), got none for " +
                             (input.points.paths.empty() ? input.contours.paths : input.points.paths).front());
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
    for (std::size_t n = 0; n < inputs.size(); ++n) {
        const RunContext own = speaking_for(inputs[n].name, run);
        StructureOutput s;
        s.name = inputs[n].name;
        s.grid = grids[n];
        Marks marks = read_marks(inputs[n].points, inputs[n].contours, &image.geometry(), own);
        prepare(marks, job.cloud, inputs[n].contours, &image.geometry(), h, session, own);
        s.marks = marks.given;
        s.input = marks.report;
        SegmentOptions options = given;
        options.contours = marks.contours;
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
        Json entry{{"name", s.name}, {"label", list.size() + 1}, {"color", color}, {"vdb_grid", s.grid}};
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
    const std::vector<StructureInput> inputs = structures_of(job);
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
        int label = 0;
        for (const StructureOutput& s : output->structures) add_result(table.row(), s.name, ++label, s.result.report);
        write_text(file, table.text());
    });
}

}  // namespace covol::tool
