#include <iomanip>
#include <sstream>

#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/compare.h"
#include "covol/error.h"
#include "covol/file_kind.h"
#include "covol/mesh_relax.h"
#include "covol/surface.h"
#include "flags/bindings.h"

namespace covol::tool {
namespace {

struct CompareJob {
    std::string a, b;
    int label = 0, label_b = -1;
    ImageFlags image;

    /// Reads a solid. Options of the image, such as --spacing, apply to label images only.
    [[nodiscard]] Solid read(const std::string& path, int wanted, const RunContext& run) const {
        if (kind_of_file(path) != FileKind::Image) {
            if (image.options.roi)
                throw Error(Errc::InvalidOptions, "--roi: expected two label images to crop, got " + path);
            return read_solid(path, wanted, run);
        }
        Solid solid;
        solid.mask = image.read(path, run);
        solid.label = wanted;
        return solid;
    }

    void run(Session& session) const {
        const bool points_a = kind_of_file(a) == FileKind::Points;
        const bool points_b = kind_of_file(b) == FileKind::Points;
        if (points_a && points_b)
            throw Error(Errc::Unsupported,
                        "compare: expected points and a .vdb or a mesh, got points twice: " + a + " and " + b);
        if ((points_a || points_b) && image.options.roi)
            throw Error(Errc::InvalidOptions, "--roi: expected two label images to crop, got " + (points_a ? a : b));
        if (points_a) return measure_points(a, b, session);
        if (points_b) return measure_points(b, a, session);
        compare_solids(session);
    }

    void compare_solids(Session& session) const {
        const Stopwatch reading;
        const Solid first = read(a, label, session.run());
        const Solid second = read(b, label_b >= 0 ? label_b : label, session.run());
        session.add_seconds("read", reading.seconds());
        const Stopwatch watch;
        const CompareReport r = compare(first, second, session.run());
        session.add_seconds("compare", watch.seconds());
        session.report()["compare"] = to_json(r);
        std::ostringstream text;
        text << std::setprecision(6) << "Dice " << r.dice << ", Jaccard " << r.jaccard << ", volumes " << r.volume_a
             << " and " << r.volume_b << "\ndistance between the surfaces: mean " << r.assd << ", 95 % " << r.hd95
             << ", max " << r.hausdorff;
        session.print(text.str());
    }

    /// The relaxed mesh of a level set, as other commands write it by default.
    static TriangleMesh mesh_of(const FloatGrid& level_set, const RunContext& run) {
        TriangleMesh mesh = extract_mesh(level_set, {}, run);
        relax_mesh(mesh, level_set, {}, run);
        return mesh;
    }
    static TriangleMesh surface_of(const std::string& path, const RunContext& run) {
        switch (kind_of_file(path)) {
            case FileKind::Vdb: return mesh_of(*read_vdb_level_set(path, run), run);
            case FileKind::Mesh: return read_mesh(path);
            default: break;
        }
        throw Error(Errc::Unsupported, "compare: " + path + ": points can be compared with a .vdb or a mesh");
    }

    /// Measures the distances of points from the surface of a solid.
    static void measure_points(const std::string& points_path, const std::string& solid_path, Session& session) {
        const std::vector<Vec3> points = to_world(read_points(points_path));
        const FitStatistics fit = measure_fit(points, surface_of(solid_path, session.run()), session.run());
        session.report()["fit"]["points_to_surface"] = to_json(fit);
        std::ostringstream text;
        text << std::setprecision(6) << "points to surface: mean " << fit.mean << ", 95 % " << fit.p95 << ", max "
             << fit.max;
        session.print(text.str());
    }
};

}  // namespace

void add_compare(Session& session) {
    const auto [job, command] = session.add_job<CompareJob>(
        "compare",
        "Compute overlap and distances of two solids (masks, meshes, .vdb, in any mix), or of points and a surface");
    in_group(*command, Group::Input);
    command->add_option("a", job->a, "label image, mesh, .vdb (:NAME selects a grid) or points")
        ->required()
        ->type_name("A");
    command->add_option("b", job->b, "label image, mesh, .vdb (:NAME selects a grid) or points")
        ->required()
        ->type_name("B");
    command->add_option("--label", job->label, "label of the masks, 0: any")->capture_default_str();
    command->add_option("--label-b", job->label_b, "label of B, if it is not the same");
    job->image.bind(*command);
}

}  // namespace covol::tool
