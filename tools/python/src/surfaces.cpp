// Mesh and LevelSet, and functions that create results from them.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <filesystem>

#include "arrays.h"
#include "classes.h"
#include "cli/output/report.h"
#include "covol/domain.h"
#include "covol/error.h"
#include "covol/mesh_cleanup.h"
#include "covol/mesh_relax.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"

namespace covol::python {
namespace {

/// The vertices: a view in single precision, or, if the mesh has an origin other than 0, a copy in double precision.
py::array vertices_of(const Mesh& mesh) {
    const auto count = static_cast<py::ssize_t>(mesh.triangles->vertices.size());
    if (mesh.triangles->origin != Vec3{0, 0, 0}) {
        std::vector<double> values;
        values.reserve(3 * mesh.triangles->vertices.size());
        for (std::size_t v = 0; v < mesh.triangles->vertices.size(); ++v) {
            const Vec3 place = mesh.triangles->place(v);
            values.insert(values.end(), place.begin(), place.end());
        }
        return give(std::move(values), {count, 3});
    }
    const auto* first = reinterpret_cast<const float*>(mesh.triangles->vertices.data());
    return show(first, {count, 3}, {3 * sizeof(float), sizeof(float)}, mesh.triangles);
}

py::array faces_of(const Mesh& mesh) {
    const auto count = static_cast<py::ssize_t>(mesh.triangles->triangles.size());
    const auto* first = reinterpret_cast<const std::uint32_t*>(mesh.triangles->triangles.data());
    return show(first, {count, 3}, {3 * sizeof(std::uint32_t), sizeof(std::uint32_t)}, mesh.triangles);
}

py::array normals_of(const Mesh& mesh) {
    const std::vector<std::array<float, 3>> normals = compute_vertex_normals(*mesh.triangles);
    std::vector<float> values;
    values.reserve(3 * normals.size());
    for (const auto& n : normals) values.insert(values.end(), n.begin(), n.end());
    return give(std::move(values), {static_cast<py::ssize_t>(normals.size()), 3});
}

py::dict attributes_of(const Mesh& mesh) {
    py::dict all;
    for (const VertexAttribute& attribute : mesh.attributes) {
        std::vector<float> values = attribute.values;
        const auto count = static_cast<py::ssize_t>(values.size());
        all[py::str(attribute.name)] = give(std::move(values), {count});
    }
    return all;
}

void save_mesh(const Mesh& mesh, const std::filesystem::path& path, std::optional<bool> y_up, double unit_scale) {
    WriteMeshOptions options;
    options.y_up = y_up;
    options.unit_scale = unit_scale;
    options.attributes = mesh.attributes;
    const py::gil_scoped_release released;
    write_mesh(path.string(), *mesh.triangles, options);
}

/// The mesh of a level set, as `covol mesh` makes it.
Mesh make_mesh(const LevelSet& surface, const py::object& isovalue, const py::object& min_component,
               const py::object& target_edge, const py::object& adaptive, int smooth, bool repair, const Call& call) {
    const double h = domain_of(*surface.grid).voxel_size;
    const auto length = [&](const char* name, const py::object& given) { return to_length(name, given).resolve(h, 0); };
    const ExtractOptions extract{length("isovalue", isovalue), std::pow(length("min_component", min_component), 3)};
    CleanupOptions cleanup;
    cleanup.target_edge = length("target_edge", target_edge);
    cleanup.adaptive = length("adaptive", adaptive);
    cleanup.smooth_iterations = smooth;
    cleanup.repair = repair;
    require_valid(cleanup, "mesh");
    const auto mesh = std::make_shared<TriangleMesh>();
    call.run([&](const RunContext& run) {
        *mesh = extract_mesh(*surface.grid, extract, run);
        if (mesh->empty())
            throw Error(Errc::InvalidInput,
                        "mesh: nothing to mesh: no surface at isovalue, or all of it smaller than min_component");
        relax_mesh(*mesh, *surface.grid, {extract.isovalue}, run);
        if (repair || smooth > 0 || cleanup.target_edge > 0 || cleanup.adaptive > 0)
            clean_mesh(*mesh, *surface.grid, extract.isovalue, cleanup, run);
    });
    return {mesh, {}};
}

py::array make_mask(const LevelSet& surface, const Image& like, int label, const Call& call) {
    between(1, 255).require("label", label);
    std::vector<std::uint8_t> voxels;
    call.run([&](const RunContext& run) {
        voxels = rasterize(*surface.grid, like.geometry(), static_cast<std::uint8_t>(label), run);
    });
    const Index3 n = like.geometry().size;
    return give(std::move(voxels), {n[2], n[1], n[0]});
}

void save_mask(const std::string& path, const py::object& voxels, const Image& like) {
    auto array = py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>::ensure(voxels);
    const Index3 n = like.geometry().size;
    if (!array) throw py::error_already_set();
    if (array.ndim() != 3 || array.shape(0) != n[2] || array.shape(1) != n[1] || array.shape(2) != n[0])
        throw Error(Errc::InvalidInput, "mask: expected the shape of the image, " +
                                            py::cast<std::string>(py::str(shape_of(n))) + ", got " +
                                            py::cast<std::string>(py::str(array.attr("shape"))));
    const auto* labels = array.data();
    const bool bytes = std::all_of(labels, labels + array.size(), [](std::int32_t v) { return v >= 0 && v <= 255; });
    const std::vector<std::uint8_t> small(labels, labels + (bytes ? array.size() : 0));
    const py::gil_scoped_release released;
    if (bytes)
        write_image(path, like.geometry(), small.data());
    else
        write_image(path, like.geometry(), labels);
}

Solid solid_of(const py::handle& given, int label, const RunContext& run) {
    Solid solid;
    solid.label = label;
    if (py::isinstance<Image>(given)) {
        solid.mask = py::cast<Image>(given);
    } else if (py::isinstance<Mesh>(given)) {
        solid.mesh = *py::cast<const Mesh&>(given).triangles;
    } else if (py::isinstance<LevelSet>(given)) {
        solid.level_set = py::cast<const LevelSet&>(given).grid;
    } else {
        const auto path = py::cast<std::string>(given);
        const py::gil_scoped_release released;
        solid = read_solid(path, label, run);
    }
    return solid;
}

py::object compare_solids(const py::object& a, const py::object& b, int label, int label_b, const Call& call) {
    const Solid first = solid_of(a, label, {}), second = solid_of(b, label_b, {});
    CompareReport report;
    call.run([&](const RunContext& run) { report = compare(first, second, run); });
    return from_json(tool::to_json(report).dump());
}

/// Distances of points from a surface.
py::object measure_points(const py::object& points, const Mesh& mesh, const Call& call) {
    const std::vector<Vec3> places = to_positions("points", points);
    if (places.empty()) throw Error(Errc::InvalidInput, "points: expected positions, got none", "points");
    FitStatistics fit;
    call.run([&](const RunContext& run) { fit = measure_fit(places, *mesh.triangles, run); });
    return from_json(tool::to_json(fit).dump());
}

}  // namespace

void add_surfaces(py::module_& module) {
    py::class_<Mesh>(module, "Mesh", "Triangles: Mesh(vertices, faces). Raises Error.")
        .def(py::init([](const py::object& vertices, const py::object& faces) {
                 return Mesh{std::make_shared<const TriangleMesh>(to_mesh(vertices, faces)), {}};
             }),
             py::arg("vertices"), py::arg("faces"))
        .def_property_readonly(
            "vertices", vertices_of,
            "(n, 3) float32, x, y, z, world units; read-only. A copy in float64 if they are so far from 0 that "
            "single precision is insufficient.")
        .def_property_readonly("faces", faces_of, "(m, 3) uint32, counter-clockwise seen from outside; read-only.")
        .def_property_readonly("normals", normals_of, "(n, 3) float32, unit vectors at the vertices.")
        .def_property_readonly("attributes", attributes_of, "Numbers at the vertices by name: dict of arrays (n,).")
        .def(
            "measure",
            [](const Mesh& mesh) { return from_json(tool::to_json(covol::measure(*mesh.triangles)).dump()); },
            "dict: volume, area (world units), components, genus, closed, manifold.")
        .def("save", save_mesh, py::arg("path"), py::kw_only(), py::arg("y_up") = py::none(),
             py::arg("unit_scale") = 1.0,
             "Writes .ply, .obj, .stl, .off or .glb, which is y-up by default; y_up overrides this. Raises Error.");
    py::class_<LevelSet>(module, "LevelSet",
                         "A level set of OpenVDB, negative inside, for mesh(), mask(), compare(), init= and guess=.")
        .def_property_readonly(
            "voxel_size", [](const LevelSet& s) { return domain_of(*s.grid).voxel_size; }, "World units.")
        .def_property_readonly(
            "box",
            [](const LevelSet& s) {
                const WorldBox box = domain_of(*s.grid).world_box();
                return py::make_tuple(from_vec3(box.min), from_vec3(box.max));
            },
            "Two corners of the domain, world units.")
        .def(
            "save",
            [](const LevelSet& s, const std::filesystem::path& path, bool half) {
                const py::gil_scoped_release released;
                write_vdb(path.string(), {s.grid}, {half, {}, VdbCompression::Blosc});
            },
            py::arg("path"), py::kw_only(), py::arg("half") = false,
            "Writes a .vdb; half: values as 16-bit floats. Raises Error.");
    module.def("read_level_set", [](const std::string& path) {
        const py::gil_scoped_release released;
        return LevelSet{read_vdb_level_set(path)};
    });
    module.def("read_mesh", [](const std::string& path) {
        const py::gil_scoped_release released;
        return Mesh{std::make_shared<const TriangleMesh>(read_mesh(path)), {}};
    });
    module.def("mesh", make_mesh);
    module.def("mask", make_mask);
    module.def("save_mask", save_mask);
    module.def("compare", compare_solids);
    module.def("distances", measure_points);
}

}  // namespace covol::python
