#include "jobs/structure_outputs.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <filesystem>

#include "cli/output/report.h"
#include "covol/file_kind.h"
#include "covol/mesh_stream.h"
#include "covol/program_marks.h"
#include "covol/slice_contours.h"
#include "covol/solid_measures.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"
#include "jobs/page.h"

namespace covol::tool {
namespace {

/// Whether a format of label images can store the structures' names.
bool keeps_names(const std::string& path) {
    for (const char* end : {".nrrd", ".NRRD", ".zarr", ".zarr/", ".dcm", ".DCM"})
        if (path.ends_with(end)) return true;
    return false;
}

std::string labels_path(const std::string& mask) { return with_ending(mask, "_labels.txt"); }

FloatGridPtr named(FloatGridPtr grid, const std::string& name) {
    grid->setName(name);
    return grid;
}

/// The grids "u", "distance" and "edge" of each structure; with several structures, named "u_ve" and so on for "ve".
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
    std::map<std::string, std::string> metadata = session.provenance().metadata();
    if (output.structures.front().result.report.holes.policy == Holes::Open)
        metadata["covol_holes"] = "closed here; the mesh alone is open";
    metadata["covol_resolved"] = resolved.dump(-1, ' ', false, Json::error_handler_t::replace);
    return metadata;
}

void hand_over_meshes(const SegmentJob& job, const std::shared_ptr<const StructuresOutput>& output,
                      const std::string& path, const Session& session, const Sink& sink) {
    if (path.empty()) return;
    const WriteMeshOptions options = job.mesh.write_options(session);
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
             [output, n, options, run = session.run()](const std::string& file) {
                 const SegmentResult& result = output->structures[n].result;
                 if (result.report.resolved.without_mesh)
                     return void(stream_mesh(file, *result.surface, 0, options, run));
                 WriteMeshOptions with_attributes = options;
                 with_attributes.attributes = vertex_attributes(output->structures[n].evidence);
                 if (!result.distance_to_points.empty())
                     with_attributes.attributes.push_back({"distance_to_points", result.distance_to_points});
                 write_mesh(file, result.mesh, with_attributes);
             });
}

using Metadata = std::vector<std::pair<std::string, std::string>>;

std::vector<NamedLabel> label_names(const StructuresOutput& output) {
    std::vector<NamedLabel> labels;
    for (std::size_t n = 0; n < output.structures.size(); ++n)
        labels.push_back({output.structures[n].label, output.structures[n].shown_name(), structure_color(n)});
    return labels;
}

/// A mask given by --guess, corrected by marks. Its label values stay as given; they are stored as 8-bit integers if
/// all are from 0 to 255, otherwise as 32-bit integers.
class CorrectedLabels : public PixelSource {
public:
    CorrectedLabels(std::shared_ptr<const StructuresOutput> output, bool has_names)
        : PixelSource(output->geometry, type_of(output->structures.front().corrected->values), true),
          output_(std::move(output)),
          has_names_(has_names) {}

    void fill(const VoxelBox& box, void* out) const override {
        if (type() == PixelType::UInt8)
            copy(box, static_cast<std::uint8_t*>(out));
        else
            copy(box, static_cast<std::int32_t*>(out));
    }
    [[nodiscard]] Metadata metadata() const override {
        if (!has_names_) return {};
        return make_slicer_segments(output_->names(), {extent()}, output_->labels());
    }
    [[nodiscard]] std::optional<std::array<double, 2>> range() const override {
        const auto [low, high] = std::minmax_element(values().begin(), values().end());
        return std::array<double, 2>{double(*low), double(*high)};
    }
    [[nodiscard]] std::vector<NamedLabel> label_names() const override {
        return has_names_ ? tool::label_names(*output_) : std::vector<NamedLabel>{};
    }

private:
    static PixelType type_of(const std::vector<std::int32_t>& values) {
        const auto [low, high] = std::minmax_element(values.begin(), values.end());
        return *low < 0 || *high > 255 ? PixelType::Int32 : PixelType::UInt8;
    }
    [[nodiscard]] const std::vector<std::int32_t>& values() const {
        return output_->structures.front().corrected->values;
    }
    [[nodiscard]] std::size_t first_of(int j, int k) const {
        const Index3 size = geometry().size;
        return (std::size_t(k) * size[1] + j) * size[0];
    }
    template <typename T>
    void copy(const VoxelBox& box, T* out) const {
        for (int k = box.min[2]; k <= box.max[2]; ++k)
            for (int j = box.min[1]; j <= box.max[1]; ++j) {
                const std::int32_t* row = values().data() + first_of(j, k);
                for (int i = box.min[0]; i <= box.max[0]; ++i) *out++ = static_cast<T>(row[i]);
            }
    }
    /// The box of the voxels with the label of the structure.
    [[nodiscard]] VoxelBox extent() const {
        const Index3 size = geometry().size;
        VoxelBox box{size, {-1, -1, -1}};
        for (int k = 0; k < size[2]; ++k)
            for (int j = 0; j < size[1]; ++j)
                for (int i = 0; i < size[0]; ++i) {
                    if (values()[first_of(j, k) + i] != output_->structures.front().label) continue;
                    const Index3 here{i, j, k};
                    for (int a = 0; a < 3; ++a) {
                        box.min[a] = std::min(box.min[a], here[a]);
                        box.max[a] = std::max(box.max[a], here[a]);
                    }
                }
        return box.max[0] < 0 ? VoxelBox{} : box;
    }

    std::shared_ptr<const StructuresOutput> output_;
    bool has_names_;
};

void hand_over_labels(const std::shared_ptr<const StructuresOutput>& output, const std::string& path,
                      const RunContext& run, const Sink& sink) {
    if (path.empty()) return;
    const bool named = !output->structures.front().name.empty();
    const bool has_names = named || is_segmentation_name(path);
    sink(path, [output, run, has_names](const std::string& file) {
        const WriteImageOptions options{true, output->image_path, output->frame};
        if (output->structures.size() == 1 && output->structures.front().corrected)
            return write_image(file, CorrectedLabels(output, has_names), options, run);
        write_image(file, LabelImage(solids(*output), output->geometry, output->labels(), has_names), options, run);
    });
    if (named && !keeps_names(path))
        sink(labels_path(path), [output, run](const std::string& file) {
            write_text(file, make_itksnap_labels(output->names(), output->labels()), run);
        });
}

void hand_over_contours(const std::shared_ptr<const StructuresOutput>& output, const std::string& path,
                        const RunContext& run, const Sink& sink) {
    sink(path, [output, run](const std::string& file) {
        std::vector<ContouredStructure> structures;
        for (const StructureOutput& s : output->structures)
            structures.push_back({s.shown_name(), structure_color(structures.size()),
                                  outline_slices(*s.result.surface, output->geometry, run)});
        write_rt_structures(file, structures, output->geometry, output->image_path, output->frame, run);
    });
}

/// The title of the page: the file name of the image, or of the output if there is no image.
std::string title_of(const SegmentJob& job) {
    const std::filesystem::path path(job.images.empty() ? job.output : job.images.front());
    return (path.has_filename() ? path : path.parent_path()).filename().string();
}

Json input_of(const StructureOutput& s) {
    Json json;
    json["points"] = {{"densified", s.result.report.densified}, {"paths", s.files.points}, {"rules", s.rules}};
    if (s.thinned) json["points"]["thinned_to"] = *s.thinned;
    json["points"]["count"] = s.count;
    if (s.cleanup) json["points"]["cleanup"] = to_json(*s.cleanup);
    if (!s.contour_rules.empty()) {
        json["contours"] = {{"paths", s.files.contours}, {"rules", s.contour_rules}};
        // resolved.contours is null if the curves form a network: their points are then used as marks.
        if (const auto& contours = s.result.report.resolved.contours)
            json["contours"].update({{"closed", contours->closed},
                                     {"open", contours->open},
                                     {"slices", contours->slices},
                                     {"slice_distance", contours->slice_distance},
                                     {"along", contours->along.size()},
                                     {"between", contours->between.size()}});
    }
    for (const auto& [path, paint] : s.paint) {
        Json entry = to_json(paint);
        entry["path"] = path;
        json["painted"].push_back(entry);
    }
    if (s.guess) json["guess"] = {{"path", s.files.guess}, {"label", s.guess->label}};
    return json;
}

Json report_of(const StructureOutput& s) {
    Json json{{"input", input_of(s)}};
    json.update(to_json(s.result.report));
    if (s.motion)
        json["motion"] = {{"translation", s.motion->translation},
                          {"mean_offset", s.motion->mean_offset},
                          {"max_offset", s.motion->max_offset},
                          {"correlation", s.motion->correlation}};
    if (s.result.correction) json["correction"] = to_json(s.result.report.correction);
    if (s.corrected)
        json["correction"]["mask"] = {
            {"added", s.corrected->added}, {"removed", s.corrected->removed}, {"reached", s.corrected->reached}};
    if (s.evidence) json["evidence"] = to_json(*s.evidence);
    if (s.intensity && s.intensity->voxels > 0)
        json["intensity"] = {{"mean", s.intensity->mean},
                             {"standard_deviation", s.intensity->standard_deviation},
                             {"voxels", s.intensity->voxels}};
    return json;
}

}  // namespace

std::vector<std::string> StructuresOutput::names() const {
    std::vector<std::string> result;
    for (const StructureOutput& s : structures) result.push_back(s.shown_name());
    return result;
}

std::vector<int> StructuresOutput::labels() const {
    std::vector<int> result;
    for (const StructureOutput& s : structures) result.push_back(s.label);
    return result;
}

std::vector<Structure> solids(const StructuresOutput& output) {
    std::vector<Structure> result;
    for (const StructureOutput& s : output.structures) result.push_back({s.shown_name(), s.result.surface});
    return result;
}

bool is_density_in_output(const SegmentJob& job) { return !job.output.empty() && job.density_path == job.output; }

std::string density_name(const StructuresOutput& output, const StructureOutput& structure) {
    return output.structures.size() > 1 ? "density_" + structure.grid : "density";
}

void check_outputs(const SegmentJob& job, const std::vector<Marks>& structures, const NameTag& tagged,
                   Outputs& outputs) {
    // --mask-label without --mask is accepted, because covol rerun repeats the settings of a run without its outputs.
    if (job.mask_label && structures.size() != 1)
        throw UsageError("--mask-label: expected one structure, got " + std::to_string(structures.size()) +
                         "; leave it out, because each of them has a value of its own, or segment one at a time");
    outputs.check("-o", tagged(job.output), OutputKind::Vdb);
    outputs.check("--mask", tagged(job.mask_path), OutputKind::Image);
    if (!job.mask_path.empty() && !structures.front().name.empty() && !keeps_names(job.mask_path))
        outputs.check("--mask", labels_path(tagged(job.mask_path)), OutputKind::Text);
    outputs.check("--rtstruct", tagged(job.rtstruct_path), OutputKind::StructureSet);
    if (!is_density_in_output(job)) outputs.check("--density", tagged(job.density_path), OutputKind::Vdb);
    outputs.check("--fields", tagged(job.fields_path), OutputKind::Vdb);
    outputs.check("--report", tagged(job.page_path), OutputKind::Page);
    outputs.check("--keep-failed", tagged(job.failed_path), OutputKind::Vdb);
    job.evidence.check(outputs, tagged);
    const std::string mesh = tagged(job.mesh_path);
    if (structures.size() == 1 || mesh.empty() || holds_several_meshes(mesh))
        return outputs.check("--mesh", mesh, OutputKind::Mesh);
    for (const std::string& grid : make_grid_names(names_of(structures)))
        outputs.check("--mesh", with_suffix(mesh, "_" + grid), OutputKind::Mesh);
}

void queue_outputs(const SegmentJob& job, const std::shared_ptr<const StructuresOutput>& output, const NameTag& tagged,
                   Session& session, const Sink& sink) {
    const bool in_one = is_density_in_output(job);
    const WriteVdbOptions vdb = job.vdb.with(metadata_of(*output, session));
    const auto fogs_of = [output] {
        std::vector<FloatGridPtr> grids;
        for (const StructureOutput& s : output->structures)
            grids.push_back(named(to_fog_volume(*s.result.surface), density_name(*output, s)));
        return grids;
    };
    sink(tagged(job.output), [output, vdb, fogs_of, in_one](const std::string& file) {
        // The fog volume comes first: some programs load only the first grid, and cannot draw level sets.
        std::vector<FloatGridPtr> grids = in_one ? fogs_of() : std::vector<FloatGridPtr>{};
        for (const StructureOutput& s : output->structures) grids.push_back(s.result.surface);
        write_vdb(file, grids, vdb);
    });
    if (!in_one)
        sink(tagged(job.density_path), [vdb, fogs_of](const std::string& file) { write_vdb(file, fogs_of(), vdb); });
    sink(tagged(job.fields_path), [output, vdb](const std::string& file) { write_vdb(file, fields_of(*output), vdb); });
    hand_over_meshes(job, output, tagged(job.mesh_path), session, sink);
    hand_over_labels(output, tagged(job.mask_path), session.run(), sink);
    hand_over_contours(output, tagged(job.rtstruct_path), session.run(), sink);
    const auto evidence_of = [output] {
        std::vector<EvidenceOf> surfaces;
        for (const StructureOutput& s : output->structures)
            surfaces.push_back({s.name.empty() ? s.grid : s.name, &*s.evidence});
        return surfaces;
    };
    sink(tagged(job.evidence.path), [evidence_of, &session](const std::string& file) {
        write_text(file, evidence_csv(evidence_of()), session.run());
    });
    sink(tagged(job.evidence.marks_path), [output, evidence_of](const std::string& file) {
        write_program_marks(file, suggested_marks(evidence_of()), output->geometry);
    });
    // The page comes last, so that it contains the complete report.
    ReportPage page;
    page.title = title_of(job) + tagged.suffix;
    for (const NameTag& frame : tagged.series) {
        if (frame.frame == tagged.frame) page.frame = page.frames.size();
        page.frames.push_back(std::filesystem::path(frame(job.page_path)).filename().string());
    }
    sink(tagged(job.page_path),
         [output, &session, page](const std::string& file) { write_page(file, *output, page, session); });
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
    Json overlaps = Json::array();
    for (const StructureOverlap& overlap : output.overlaps) {
        Json entry{{"structures", {output.structures[overlap.a].name, output.structures[overlap.b].name}},
                   {"volume", overlap.volume}};
        if (overlap.inner) entry["inner"] = output.structures[*overlap.inner].name;
        overlaps.push_back(entry);
    }
    return {{"structures", list}, {"overlaps", overlaps}};
}

std::vector<std::string> result_columns(const std::string& unit) {
    const auto of_length = [&](const std::string& name, const std::string& power = "") {
        return unit.empty() ? name : name + " (" + unit + power + ")";
    };
    return {"structure",
            "label",
            of_length("volume", "^3"),
            of_length("area", "^2"),
            "sphericity",
            of_length("extent_x"),
            of_length("extent_y"),
            of_length("extent_z"),
            of_length("centroid_x"),
            of_length("centroid_y"),
            of_length("centroid_z"),
            "components",
            "genus",
            "closed",
            of_length("fit_mean"),
            of_length("fit_p95"),
            of_length("fit_max"),
            "intensity_mean",
            "intensity_sd",
            "steps",
            "stop_reason",
            "seconds"};
}

std::optional<IntensityStatistics> intensity_within(const Image& image, const FloatGrid& surface, double max_read,
                                                    const RunContext& run) {
    if (image.chunks() && count_voxels_around(image, surface) > max_read) return {};
    return measure_intensity(image, surface, run);
}

void add_result(Table& table, const std::string& name, int label, const SegmentResult& result,
                const std::optional<IntensityStatistics>& intensity, const RunContext& run) {
    const SegmentReport& r = result.report;
    const SolidMeasures solid = measure_solid(*result.surface, run);
    table << name << label << r.surface.volume << r.surface.area << sphericity(r.surface.volume, r.surface.area);
    for (std::size_t a = 0; a < 3; ++a) table << solid.box.max[a] - solid.box.min[a];
    for (std::size_t a = 0; a < 3; ++a) table << solid.centroid[a];
    table << r.surface.components << r.surface.genus << (r.surface.closed ? "true" : "false");
    if (r.point_count > 0)
        table << r.fit.mean << r.fit.p95 << r.fit.max;
    else
        table << ""
              << ""
              << "";
    if (intensity && intensity->voxels > 0)
        table << intensity->mean << intensity->standard_deviation;
    else
        table << ""
              << "";
    table << r.solve.steps << to_string(r.solve.stop_reason) << r.seconds.total;
}

}  // namespace covol::tool
