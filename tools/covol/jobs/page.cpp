#include "jobs/page.h"

#include <cmath>
#include <filesystem>
#include <sstream>

#include "cli/shear.h"
#include "cli/system/memory.h"
#include "covol/structures.h"

namespace covol::tool {
namespace {

/// Adds the mean displacement of the surface in each step, voxels, to the facts of the page. JSON reports omit them.
void add_changes(const SegmentReport& report, Json& facts) {
    if (!report.solve.changes.empty()) facts["solve"]["changes"] = report.solve.changes;
}

}  // namespace

bool is_anatomical(const std::string& image_path, const ReadImageOptions& options, const RunContext& run) {
    const ImageInfo info = read_image_info(image_path, options, run);
    if (info.format.starts_with("DICOM") || info.format.starts_with("NIfTI")) return true;
    return (info.format == "NRRD" || info.format == "MetaImage") && info.geometry.unit == "mm";
}

Json page_facts(const Session& session) {
    Json facts = session.report();
    for (const char* other : {"frames", "page"}) facts.erase(other);
    facts["command_line"] = session.command_line();
    facts["given"] = session.given();
    facts["peak_rss_bytes"] = peak_rss();
    return facts;
}

void write_page(const std::string& path, const ReportPage& page, Session& session) {
    if (page.image != nullptr && shear_of(page.image->geometry()) > 0) {
        session.run().warn(
            "the image's axes are sheared, and the page can show slices of images with perpendicular axes only: "
            "it has no slices");
        ReportPage bare = page;
        bare.image = nullptr;
        return write_page(path, bare, session);
    }
    const Stopwatch watch;
    const ReportPageSummary made = write_report_page(path, page, {}, session.run());
    session.report()["page"] = {{"path", session.outputs().shown(path)},
                                {"bytes", made.bytes},
                                {"triangles", made.triangles},
                                {"seconds", watch.seconds()},
                                {"slices", {{"size", made.slices_size}, {"step", made.slices_step}}}};
    std::ostringstream text;
    text << "report page: " << std::ceil(double(made.bytes) / 1e5) / 10 << " MB, " << made.triangles << " triangles";
    if (const Index3& size = made.slices_size; size[0] > 0)
        text << ", " << size[0] << " x " << size[1] << " x " << size[2] << " voxels of slices";
    session.note(text.str());
}

void write_page(const std::string& path, const StructuresOutput& output, ReportPage page, Session& session) {
    Json facts = page_facts(session);
    facts.update(to_json(output), true);
    std::vector<Evidence> distances(output.structures.size());  // only distances to marks: shown without other evidence
    for (std::size_t n = 0; n < output.structures.size(); ++n) {
        const StructureOutput& s = output.structures[n];
        PageStructure shown;
        shown.name = s.name.empty() ? s.grid : s.name;
        if (output.structures.size() > 1) shown.color = structure_color(n);
        shown.mesh = &s.result.mesh;
        shown.marks = s.marks;
        distances[n].distance_to_marks = s.result.distance_to_points;
        if (s.evidence)
            shown.evidence = &*s.evidence;
        else if (!s.result.distance_to_points.empty())
            shown.evidence = &distances[n];
        page.structures.push_back(std::move(shown));
        add_changes(s.result.report, facts.contains("structures") ? facts["structures"][n] : facts);
    }
    if (output.image) {
        page.image = &*output.image;
        page.unit = output.geometry.unit;
        page.is_anatomical = output.is_anatomical;
    }
    page.facts = facts.dump(-1, ' ', false, Json::error_handler_t::replace);
    write_page(path, page, session);
}

}  // namespace covol::tool
