#include "jobs/structures_job.h"

#include <openvdb/openvdb.h>

#include <cmath>
#include <iomanip>
#include <optional>
#include <sstream>

#include "cli/output/report.h"
#include "covol/error.h"
#include "covol/vdb_io.h"
#include "jobs/page.h"
#include "jobs/usd_scene.h"

namespace covol::tool {
namespace {

constexpr std::size_t kMaxInLines = 4;  // a summary of more structures is printed as a table

/// Whether the lattices are equal up to the rounding of file formats.
bool is_same_lattice(const ImageGeometry& a, const ImageGeometry& b) {
    if (a.size != b.size) return false;
    const double slack = 1e-3 * b.smallest_spacing();
    for (const Vec3& corner :
         {Vec3{0, 0, 0}, Vec3{double(a.size[0]), 0, 0}, Vec3{0, double(a.size[1]), 0}, Vec3{0, 0, double(a.size[2])}}) {
        const Vec3 p = a.index_to_world(corner), q = b.index_to_world(corner);
        if (std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) > slack) return false;
    }
    return true;
}

void add_seconds(Session& session, const SegmentReport::Seconds& seconds) {
    session.add_seconds("distance", seconds.distance);
    session.add_seconds("tag", seconds.tag);
    session.add_seconds("coarse", seconds.coarse);
    session.add_seconds("edge", seconds.edge);
    session.add_seconds("solve", seconds.solve);
    session.add_seconds("surface", seconds.surface);
}

/// Writes the state of a failed run to the file of --keep-failed immediately, although other outputs are not written.
void keep_failed(const SegmentJob& job, const StructureFacts& s, const SegmentFailed& failed, Session& session) {
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
    std::map<std::string, std::string> metadata = session.provenance().metadata();
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
        if (s.evidence) print_evidence(session, *s.evidence, s.shown_name() + ": ");
    }
    for (const std::string& line : aligned(rows)) session.note(line);
    if (!unused.empty()) session.warn(unused);
}

void summarise(const StructuresOutput& output, const SegmentJob& job, Session& session) {
    if (output.structures.size() > kMaxInLines) return summarise_in_table(output, job, session);
    for (const StructureOutput& s : output.structures) {
        const std::string who = s.name.empty() ? "" : s.name + ": ";
        for (const std::string& line : summary(s.result.report)) session.note(who + line);
        if (const std::string line = job.unused(s.result.report); !line.empty()) session.warn(who + line);
        if (s.evidence) print_evidence(session, *s.evidence, who);
    }
}

}  // namespace

StructuresOutput finish(const SegmentJob& job, StructuresResult result, const std::optional<Image>& image,
                        Session& session, const RunContext& run) {
    StructuresOutput output;
    if (image) {
        output.geometry = image->geometry();
        output.image_path = image->path();
    }
    if (image && !job.page_path.empty()) {
        output.image = *image;
        output.is_anatomical = is_anatomical(image->path(), job.image.options, run);
    }
    output.overlaps = std::move(result.overlaps);
    for (StructureResult& structure : result.structures) {
        StructureOutput& s = output.structures.emplace_back(StructureOutput{std::move(structure), {}, {}, {}});
        if (s.guess && s.guess->mask) {
            s.label = s.guess->label;
            if (!job.mask_path.empty() && is_same_lattice(s.guess->mask->geometry(), output.geometry))
                s.corrected = s.result.correction->apply(*s.guess->mask, s.label, run);
            else if (!job.mask_path.empty())
                run.warn("--guess: " + s.files.guess +
                         " does not lie on the image's voxels; the mask is made from the corrected surface");
        }
        if (job.mask_label && s.corrected)
            run.warn("--mask-label has no effect: the mask is " + s.files.guess +
                     " with corrections, and keeps its values");
        else if (job.mask_label)
            s.label = *job.mask_label;
        session.add_seconds("contours", s.contour_seconds);
        add_seconds(session, s.result.report.seconds);
        // max_read = 0: of an image in chunks, the segmentation has read only the chunks near marks and surface. No
        // more are read for statistics, so that such an image gets none.
        if (image) s.intensity = intensity_within(*image, *s.result.surface, 0, run);
        if (image && job.evidence.wanted()) s.evidence = job.evidence.judge(s.result, s.marks, *image, run);
    }
    if (output.structures.size() > 1) session.add_seconds("separate", result.separate_seconds);
    summarise(output, job, session);
    return output;
}

void run_structures(const SegmentJob& job, Session& session, const StructureSolver& solve) {
    Outputs& outputs = session.outputs();
    std::vector<Marks> structures = structures_of(job, job.painted.read(session.run()));
    check_outputs(job, structures, {}, outputs);
    check_scene(job, outputs);
    outputs.check("--table", job.table_path, OutputKind::Table);
    if (session.brick())
        job.check_settings();
    else
        job.check_options();

    add_starts(job, structures, session.run());
    ReadImageOptions reading = job.image.options;
    if (job.frames.given) reading.frame = job.frames.first;
    std::optional<Image> image;
    if (!job.images.empty()) image = job.read(job.images.front(), reading, session);
    const StructuresOptions options = read_structures(job, structures, image, session, session.run());
    const auto solve_or_keep = [&](const std::optional<Image>& pixels, const StructureInput& structure,
                                   const RunContext& run) {
        try {
            return solve(pixels, structure, run);
        } catch (const SegmentFailed& failed) {
            keep_failed(job, structure, failed, session);
            throw;
        }
    };
    const auto found = std::make_shared<StructuresOutput>(
        finish(job, segment_structures(image, std::move(structures), options, session.run(), solve_or_keep), image,
               session, session.run()));
    found->frame = reading.frame;
    const std::shared_ptr<const StructuresOutput> output = found;
    session.report().update(to_json(*output), true);
    if (image) SegmentJob::report_chunks(*image, session);
    queue_outputs(job, output, {}, session,
                  [&](const std::string& path, auto write) { outputs.add(path, std::move(write)); });
    UsdScene scene;
    add_to_scene(scene, job, *output, {});
    write_scene(scene, job, session);
    outputs.add(job.table_path, [output, &session](const std::string& file) {
        Table table(result_columns(output->geometry.unit));
        for (const StructureOutput& s : output->structures)
            add_result(table.row(), s.name.empty() ? s.grid : s.name, s.label, s.result, s.intensity, session.run());
        write_text(file, table.text(), session.run());
    });
}

}  // namespace covol::tool
