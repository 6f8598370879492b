// segment() and reconstruct(), and what they return.
#include <pybind11/stl.h>

#include "arrays.h"
#include "classes.h"
#include "cli/output/report.h"
#include "covol/error.h"
#include "covol/surface.h"

namespace covol::python {
namespace {

Shape to_shape(const char* name, const py::object& given) {
    if (given.is_none()) return {};
    if (py::isinstance<py::str>(given)) return py::cast<std::string>(given);
    if (py::isinstance<LevelSet>(given)) return py::cast<LevelSet>(given);
    if (py::isinstance<Image>(given)) return py::cast<Image>(given);
    reject(name, "a text, a mask or a LevelSet", py::type::of(given));
}

GivenMarks to_marks(const py::handle& name, const py::handle& inputs) {
    const auto clouds = [&](const char* kind) { return py::cast<std::vector<PointCloud>>(inputs[kind]); };
    GivenMarks marks{py::cast<std::string>(name),
                     clouds("points"),
                     clouds("contours"),
                     clouds("inside"),
                     clouds("outside"),
                     {},
                     to_shape("init", inputs["init"]),
                     to_shape("guess", inputs["guess"])};
    if (const py::object seeds = inputs["exterior_seed"]; !seeds.is_none())
        marks.exterior_seeds = to_positions("exterior_seed", seeds);
    if (const py::object painted = inputs["painted"]; !painted.is_none()) marks.painted = py::cast<Image>(painted);
    return marks;
}

/// @param marks    inputs of each structure, by name
/// @param painted  the label image or None, its label of the outside, and "auto", "slices" or "scribbles"
/// @return the results, and for each overlap the indices of both structures, the common volume in world units^3, and
///     the index of the structure that was carved out of the other, or None
py::tuple run_job(const char* function, const std::optional<Image>& image, const py::dict& marks,
                  const py::tuple& painted, const py::object& init, const py::dict& keywords, const Call& call,
                  TimeLapse* lapse) {
    const GivenOptions given(function, keywords);
    Problem problem{image, {}, std::nullopt, {}, to_shape("init", init)};
    for (const auto& [name, inputs] : marks) problem.structures.push_back(to_marks(name, inputs));
    if (!painted[0].is_none()) problem.painted = py::cast<Image>(painted[0]);
    problem.painting.outside_label = py::cast<int>(painted[1]);
    problem.painting.as = to_choice<PaintedAs>("painted_as", painted[2]);
    const Solution made = solve(problem, given, call, lapse);
    py::list overlaps;
    for (const StructureOverlap& o : made.overlaps) overlaps.append(py::make_tuple(o.a, o.b, o.volume, o.inner));
    return py::make_tuple(made.structures, overlaps);
}

/// The report of a structure, with the fields that the program writes, but without paths.
py::object report_of(const Result& r) {
    const SegmentReport& report = r.result.report;
    tool::Json json = tool::to_json(report);
    json["warnings"] = report.warnings;
    json["input"]["points"] = {{"count", report.point_count}, {"densified", report.densified}};
    if (r.image) json["input"]["image"] = tool::to_json(r.image->geometry());
    const SegmentReport::Seconds& s = report.seconds;
    json["seconds"] = {{"distance", s.distance}, {"tag", s.tag},         {"coarse", s.coarse}, {"edge", s.edge},
                       {"solve", s.solve},       {"surface", s.surface}, {"total", s.total}};
    return from_json(json.dump());
}

const Image& image_of(const Result& r, const std::string& what) {
    if (!r.image) throw Error(Errc::InvalidInput, what + ": expected an image, got points alone");
    return *r.image;
}

/// The mask of a result: the guess with its own values if it is a mask that was corrected; otherwise 1 at voxels whose
/// centre is inside.
py::array mask_of(const Result& r, const Call& call) {
    const Image& image = image_of(r, "mask");
    const Image* const guess = r.guess && r.guess->mask ? &*r.guess->mask : nullptr;
    std::vector<std::uint8_t> voxels;
    std::vector<std::int32_t> labels;
    call.run([&](const RunContext& run) {
        if (guess != nullptr) labels = r.result.correction->apply(*guess, r.guess->label, run).values;
        if (guess == nullptr) voxels = rasterize(*r.result.surface, image.geometry(), 1, run);
    });
    const Index3 n = (guess != nullptr ? *guess : image).geometry().size;
    const std::vector<py::ssize_t> shape{n[2], n[1], n[0]};
    return labels.empty() ? give(std::move(voxels), shape) : give(std::move(labels), shape);
}

/// The numbers of the structures, from 1, at voxels whose centre is inside; 0 outside of all.
py::array label_image(const std::vector<std::shared_ptr<Result>>& results, const Call& call) {
    const ImageGeometry geometry = image_of(*results.at(0), "mask").geometry();
    std::vector<Structure> solids;
    for (const auto& r : results) solids.push_back({r->name.empty() ? r->grid : r->name, r->result.surface});
    std::vector<std::uint8_t> voxels;
    call.run([&](const RunContext& run) { voxels = make_label_image(solids, geometry, run); });
    return give(std::move(voxels), {geometry.size[2], geometry.size[1], geometry.size[0]});
}

Mesh mesh_of(const std::shared_ptr<Result>& r) {
    Mesh mesh{{r, &r->result.mesh}, {}};
    if (!r->result.distance_to_points.empty())
        mesh.attributes.push_back({"distance_to_points", r->result.distance_to_points});
    return mesh;
}

/// (slice, index (z, y, x), world position (x, y, z), area) for each slice on which marks would improve the result.
py::list suggest(const Result& r, int count, const Call& call) {
    kNotNegative.require("count", count);
    const Image& image = image_of(r, "suggest");
    Evidence evidence;
    call.run([&](const RunContext& run) { evidence = assess_evidence(r.result, r.marks, image, count, run); });
    py::list all;
    for (const Suggestion& s : evidence.suggestions)
        all.append(
            py::make_tuple(s.slice, py::make_tuple(s.index[2], s.index[1], s.index[0]), from_vec3(s.world), s.area));
    return all;
}

py::object grid_of(const FloatGridPtr& grid) { return grid ? py::cast(LevelSet{grid}) : py::none(); }

}  // namespace

void add_jobs(py::module_& module) {
    py::class_<Call>(module, "Call")
        .def(py::init([](py::object progress, py::object log, int threads, std::uint64_t memory_limit) {
            kNotNegative.require("threads", threads);
            return Call{std::move(progress), std::move(log), threads, memory_limit};
        }));
    py::class_<Result, std::shared_ptr<Result>>(module, "Result", "The result of segment() and reconstruct().",
                                                py::dynamic_attr())
        .def_property_readonly(
            "surface", [](const Result& r) { return LevelSet{r.result.surface}; },
            "The LevelSet: a signed distance, world units.")
        .def_property_readonly("mesh", mesh_of, "The Mesh: manifold, outward; closed unless holes are left open.")
        .def_property_readonly(
            "image", [](const Result& r) { return r.image; }, "The Image; None if there are only points.")
        .def_property_readonly(
            "marks", [](const Result& r) { return from_positions(r.marks); },
            "(n, 3), the marks as they were used, in world units.")
        .def_property_readonly(
            "log", [](const Result& r) { return r.log; }, "Choices and warnings, in the order in which they were made.")
        .def_property_readonly(
            "name", [](const Result& r) { return r.name; }, "Name of the structure; empty if it is the only one.")
        .def_property_readonly(
            "label", [](const Result& r) { return r.label; }, "Label of the structure in Structures.mask.")
        .def("_fields",
             [](const Result& r) {
                 return py::make_tuple(grid_of(r.result.u), grid_of(r.result.distance), grid_of(r.result.edge));
             })
        .def("_report", report_of)
        .def("_mask", mask_of)
        .def("_suggest", suggest);
    py::class_<TimeLapse>(module, "TimeLapse").def(py::init()).def_property_readonly("started", &TimeLapse::started);
    module.def("run", run_job);
    module.def("label_image", label_image);
}

}  // namespace covol::python
