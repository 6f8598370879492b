// segment() and reconstruct(), and what they return.
#include <pybind11/stl.h>

#include "arrays.h"
#include "classes.h"
#include "cli/report.h"
#include "covol/error.h"
#include "covol/surface.h"
#include "flags/judge.h"

namespace covol::python {
namespace {

Shape to_shape(const char* name, const py::object& given) {
    if (given.is_none()) return {};
    if (py::isinstance<py::str>(given)) return py::cast<std::string>(given);
    if (py::isinstance<LevelSet>(given)) return py::cast<LevelSet>(given);
    if (py::isinstance<Image>(given)) return py::cast<Image>(given);
    reject(name, "a text, a mask or a LevelSet", py::type::of(given));
}

std::shared_ptr<Result> run_job(const char* function, const std::optional<Image>& image, const py::dict& inputs,
                                const py::dict& keywords, const Call& call) {
    const GivenOptions given(function, keywords);
    Marks marks;
    const auto clouds = [&](const char* name) { return py::cast<std::vector<PointCloud>>(inputs[name]); };
    marks.points = clouds("points");
    marks.contours = clouds("contours");
    marks.inside = clouds("inside");
    marks.outside = clouds("outside");
    if (const py::object painted = inputs["painted"]; !painted.is_none()) marks.painted = py::cast<Image>(painted);
    marks.init = to_shape("init", inputs["init"]);
    marks.guess = to_shape("guess", inputs["guess"]);
    return solve(image, marks, given, call);
}

/// As the program writes it, without the paths.
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

const Image& image_of(const Result& r) {
    if (!r.image) throw Error(Errc::InvalidInput, "mask: expected an image to lay it on, got points alone");
    return *r.image;
}

/// Of a mask that marks corrected its own values; else 1 where a voxel's centre is inside.
py::array mask_of(const Result& r, const Call& call) {
    const Image& image = image_of(r);
    std::vector<std::uint8_t> voxels;
    std::vector<std::int32_t> labels;
    call.run([&](const RunContext& run) {
        if (r.guess_mask && r.result.correction)
            labels = r.result.correction->apply(*r.guess_mask, r.label, run).values;
        else
            voxels = rasterize(*r.result.surface, image.geometry(), 1, run);
    });
    const Index3 n = r.guess_mask ? r.guess_mask->geometry().size : image.geometry().size;
    const std::vector<py::ssize_t> shape{n[2], n[1], n[0]};
    return labels.empty() ? give(std::move(voxels), shape) : give(std::move(labels), shape);
}

Mesh mesh_of(const std::shared_ptr<Result>& r) {
    Mesh mesh{{r, &r->result.mesh}, {}};
    if (!r->result.distance_to_points.empty())
        mesh.attributes.push_back({"distance_to_points", r->result.distance_to_points});
    return mesh;
}

/// (slice, (z, y, x), (x, y, z), area) for each slice where marks would help.
py::list suggest(const Result& r, int count, const Call& call) {
    kNotNegative.require("count", count);
    const Image& image = image_of(r);
    Evidence evidence;
    call.run([&](const RunContext& run) { evidence = tool::judge(r.result, r.marks, image, count, run); });
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
    py::class_<Result, std::shared_ptr<Result>>(module, "Result", "What segment() and reconstruct() return.",
                                                py::dynamic_attr())
        .def_property_readonly(
            "surface", [](const Result& r) { return LevelSet{r.result.surface}; },
            "The LevelSet: a signed distance, world units.")
        .def_property_readonly("mesh", mesh_of, "The Mesh: closed, manifold, outward.")
        .def_property_readonly(
            "image", [](const Result& r) { return r.image; }, "The Image; None of points alone.")
        .def_property_readonly(
            "marks", [](const Result& r) { return from_positions(r.marks); }, "(n, 3), as they were used, world units.")
        .def_property_readonly(
            "log", [](const Result& r) { return r.log; }, "Choices and warnings, in their order.")
        .def("_fields",
             [](const Result& r) {
                 return py::make_tuple(grid_of(r.result.u), grid_of(r.result.distance), grid_of(r.result.edge));
             })
        .def("_report", report_of)
        .def("_mask", mask_of)
        .def("_suggest", suggest);
    module.def("run", run_job);
}

}  // namespace covol::python
