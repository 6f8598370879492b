#include "jobs/structure_outputs.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <filesystem>

#include "cli/report.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"

namespace covol::tool {
namespace {

bool is_nrrd(const std::string& path) { return path.ends_with(".nrrd") || path.ends_with(".NRRD"); }

std::string labels_path(const std::string& mask) {
    return std::filesystem::path(with_suffix(mask, "_labels")).replace_extension(".txt").string();
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
    if (output.structures.front().result.report.holes.policy == Holes::Open)
        metadata["covol_holes"] = "closed here; the mesh alone is open";
    metadata["covol_resolved"] = resolved.dump(-1, ' ', false, Json::error_handler_t::replace);
    return metadata;
}

void hand_over_meshes(const SegmentJob& job, const std::shared_ptr<const StructuresOutput>& output,
                      const std::string& path, const Session& session, const Sink& sink) {
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
                 WriteMeshOptions with_attributes = options;
                 with_attributes.attributes = vertex_attributes(output->structures[n].evidence);
                 const SegmentResult& result = output->structures[n].result;
                 if (!result.distance_to_points.empty())
                     with_attributes.attributes.push_back({"distance_to_points", result.distance_to_points});
                 write_mesh(file, result.mesh, with_attributes);
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

void hand_over_labels(const std::shared_ptr<const StructuresOutput>& output, const std::string& path,
                      const RunContext& run, const Sink& sink) {
    if (path.empty()) return;
    const bool has_names = !output->structures.front().name.empty();
    sink(path, [output, run, has_names](const std::string& file) {
        const std::vector<int> label_of = output->labels();
        if (const StructureOutput& only = output->structures.front();
            output->structures.size() == 1 && only.corrected) {
            std::vector<std::pair<std::string, std::string>> segments;
            std::vector<std::uint8_t> own;
            for (const std::int32_t value : only.corrected->values) own.push_back(value == only.label ? 1 : 0);
            if (has_names) segments = make_slicer_segments(output->names(), own, output->geometry.size, label_of);
            return write_labels(file, output->geometry, only.corrected->values, segments);
        }
        const std::vector<std::uint8_t> labels = make_label_image(solids(*output), output->geometry, run);
        std::vector<std::int32_t> values(labels.begin(), labels.end());
        for (std::int32_t& value : values)
            if (value > 0) value = label_of[std::size_t(value) - 1];
        write_labels(file, output->geometry, values,
                     has_names ? make_slicer_segments(output->names(), labels, output->geometry.size, label_of)
                               : std::vector<std::pair<std::string, std::string>>{});
    });
    if (has_names && !is_nrrd(path))
        sink(labels_path(path), [output](const std::string& file) {
            write_text(file, make_itksnap_labels(output->names(), output->labels()));
        });
}

Json report_of(const StructureOutput& s) {
    Json json{{"input", s.input}};
    json.update(to_json(s.result.report));
    if (s.result.correction) json["correction"] = to_json(s.result.report.correction);
    if (s.corrected)
        json["correction"]["mask"] = {
            {"added", s.corrected->added}, {"removed", s.corrected->removed}, {"reached", s.corrected->reached}};
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

std::vector<int> StructuresOutput::labels() const {
    std::vector<int> result;
    for (const StructureOutput& s : structures) result.push_back(s.label);
    return result;
}

std::vector<Structure> solids(const StructuresOutput& output) {
    std::vector<Structure> result;
    for (const StructureOutput& s : output.structures) result.push_back({s.name, s.result.surface});
    return result;
}

void check_outputs(const SegmentJob& job, const std::vector<StructureInput>& inputs, const std::string& tag,
                   Outputs& outputs) {
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
    if (inputs.size() == 1 || mesh.empty() || holds_several_meshes(mesh))
        return outputs.check("--mesh", mesh, OutputKind::Mesh);
    for (const std::string& grid : make_grid_names(names_of(inputs)))
        outputs.check("--mesh", with_suffix(mesh, "_" + grid), OutputKind::Mesh);
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
            grids.push_back(named(to_fog_volume(*s.result.surface),
                                  output->structures.size() > 1 ? "density_" + s.grid : "density"));
        write_vdb(file, grids, vdb);
    });
    sink(tagged(job.fields_path), [output, vdb](const std::string& file) { write_vdb(file, fields_of(*output), vdb); });
    hand_over_meshes(job, output, tagged(job.mesh_path), session, sink);
    hand_over_labels(output, tagged(job.mask_path), session.run(), sink);
    sink(tagged(job.evidence.path), [output](const std::string& file) {
        std::vector<EvidenceOf> surfaces;
        for (const StructureOutput& s : output->structures)
            surfaces.push_back({s.name.empty() ? s.grid : s.name, &*s.evidence});
        write_text(file, evidence_csv(surfaces));
    });
}

Json to_json(const StructuresOutput& output) {
    if (output.structures.size() == 1 && output.structures.front().name.empty())
        return report_of(output.structures.front());
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
    return {"structure", "label",   "volume",  "area",  "components",  "genus",  "closed",
            "fit_mean",  "fit_p95", "fit_max", "steps", "stop_reason", "seconds"};
}

void add_result(Table& table, const std::string& name, int label, const SegmentReport& r) {
    table << name << label << r.surface.volume << r.surface.area << r.surface.components << r.surface.genus
          << (r.surface.closed ? "true" : "false");
    if (r.point_count > 0)
        table << r.fit.mean << r.fit.p95 << r.fit.max;
    else
        table << ""
              << ""
              << "";
    table << r.solve.steps << to_string(r.solve.stop_reason) << r.seconds.total;
}

}  // namespace covol::tool
