// Image and Points.
#include <pybind11/stl.h>

#include <filesystem>
#include <map>

#include "arrays.h"
#include "classes.h"
#include "covol/error.h"
#include "covol/phantom.h"
#include "covol/point_array.h"
#include "covol/safe_text.h"
#include "covol/study.h"
#include "covol/study_files.h"
#include "options.h"
#include "solve.h"

namespace covol::python {
namespace {

const char* space_name(PointSpace space) { return space == PointSpace::Slices ? "slices" : to_string(space); }

ImageGeometry make_geometry(const py::handle& spacing, const py::handle& origin, const py::handle& direction,
                            const std::string& unit) {
    ImageGeometry geometry;
    if (!spacing.is_none()) geometry.spacing = to_vec3("spacing", spacing);
    if (!origin.is_none()) geometry.origin = to_vec3("origin", origin);
    if (!direction.is_none()) geometry.direction = to_matrix("direction", direction);
    geometry.unit = unit;
    return geometry;
}

Image read(const std::string& path, const py::object& spacing, const std::optional<int>& channel,
           const std::optional<int>& frame, const py::object& roi, bool correct_level_shift, const Call& call) {
    ReadImageOptions options;
    if (!spacing.is_none()) options.spacing = to_vec3("spacing", spacing);
    options.channel = channel;
    options.frame = frame;
    options.correct_level_shift = correct_level_shift;
    if (!roi.is_none()) {
        const std::vector<Vec3> corners = to_positions("roi", roi);
        if (corners.size() != 2) reject("roi", "two corners", roi);
        options.roi = WorldBox{corners[0], corners[1]};
    }
    std::optional<Image> image;
    call.run([&](const RunContext& run) {
        image = read_image(path, options, run);
        if (options.roi) image = image->cropped();
    });
    return *image;
}

ReadPointsOptions make_reading(const py::object& space, const py::object& order, double scale, int channels) {
    ReadPointsOptions reading;
    if (!space.is_none()) reading.space = to_choice<PointSpace>("points_space", space);
    if (!order.is_none()) reading.order = to_choice<PointOrder>("points_order", order);
    reading.scale = scale;
    reading.channels = channels;
    require_valid(reading, "read_points");
    return reading;
}

/// Points from one array of positions, or from several lines, which are concatenated.
PointCloud make_points(const std::string& name, const py::object& positions, const std::optional<py::list>& lines,
                       const py::object& space, const py::object& order, double scale, bool closed,
                       const py::object& normals) {
    const ReadPointsOptions reading = make_reading(space, order, scale, 1);
    if (!lines) {
        PointCloud cloud = make_cloud(to_positions(name.c_str(), positions), reading, name);
        if (normals.is_none()) return cloud;
        cloud.normals = make_cloud(to_positions("normals", normals), {cloud.reading.space, cloud.reading.order}).points;
        if (cloud.normals.size() != cloud.points.size() || cloud.space != PointSpace::World)
            throw Error(Errc::InvalidInput,
                        "normals: expected one for each point, both in world units, got " +
                            std::to_string(cloud.normals.size()) + " for " + std::to_string(cloud.points.size()) +
                            " points in space '" + space_name(cloud.space) + "'",
                        "normals");
        return cloud;
    }
    std::vector<Vec3> all;
    std::vector<MarkLine> marked;
    for (const py::handle& line : *lines) {
        const std::vector<Vec3> one = to_positions(name.c_str(), line);
        marked.push_back({all.size(), all.size() + one.size(), closed, ""});
        all.insert(all.end(), one.begin(), one.end());
    }
    PointCloud cloud = make_cloud(all, reading, name);
    cloud.lines = std::move(marked);
    return cloud;
}

/// The guess of `marks` as an argument of structures(): a mask, a level set, or, for a mesh, its `path`.
py::object guess_of(const Marks& marks, const std::string& path) {
    const Start start = marks.guess({}).start;
    if (const auto* mask = std::get_if<MaskStart>(&start)) return py::cast(*mask->mask);
    if (const auto* grid = std::get_if<LevelSetStart>(&start)) return py::cast(LevelSet{grid->level_set});
    return py::str(path);
}

/// The options of a study as keyword arguments of structures().
py::dict options_of_study(const std::string& folder) {
    const StudyOptions options = read_study_options(folder);
    py::dict keywords;
    if (options.voxel_size) keywords["voxel_size"] = *options.voxel_size;
    if (options.rho) keywords["rho"] = *options.rho;
    if (options.mark_precision) keywords["mark_precision"] = *options.mark_precision;
    if (options.model) keywords["model"] = kWords<Model>[std::size_t(*options.model)];
    return keywords;
}

/// The marks of each structure of a study, as arguments of structures().
py::dict marks_of_study(const std::string& folder) {
    py::dict structures;
    const ImageGeometry image = read_study_image(folder).geometry;
    const StudyState state = read_study(folder);
    std::map<std::string, std::string> guesses;  // paths by the name of the structure
    for (const auto& structure : state)
        if (structure->guess)
            guesses[safe_text(structure->name)] =
                (std::filesystem::path(folder) / structure->guess->path).lexically_normal().string();
    for (const Marks& marks : marks_of(state, open_study_site(folder, image))) {
        py::dict kinds;
        if (!marks.points.empty()) kinds["points"] = make_cloud(marks.points, {PointSpace::World, PointOrder::XYZ});
        const auto add = [&](const char* kind, const std::vector<PointCloud>& clouds) {
            if (!clouds.empty()) kinds[kind] = clouds.front();
        };
        add("contours", marks.contours);
        add("inside", marks.inside);
        add("outside", marks.outside);
        if (!marks.paint.empty()) kinds["painted"] = marks.paint.front().image->image;
        if (marks.guess) kinds["guess"] = guess_of(marks, guesses[marks.name]);
        structures[marks.name.c_str()] = kinds;
    }
    return structures;
}

py::tuple make_test_shape(const std::string& kind, int size, int points, double noise, std::uint64_t seed) {
    Phantom made = make_phantom({kind, size, points, noise, seed});
    const Index3 n = made.image.geometry().size;
    return py::make_tuple(made.image, from_positions(made.points), give(std::move(made.labels), {n[2], n[1], n[0]}));
}

}  // namespace

void add_image(py::module_& module) {
    py::class_<Image>(
        module, "Image",
        "A 3D image with its geometry: Image(array, spacing=, origin=, direction=, unit=), as for segment(). "
        "The array is copied only if necessary. Raises Error.")
        .def(py::init([](const py::object& array, const py::object& spacing, const py::object& origin,
                         const py::object& direction, const std::string& unit) {
                 return to_image(array, make_geometry(spacing, origin, direction, unit));
             }),
             py::arg("array"), py::kw_only(), py::arg("spacing") = py::none(), py::arg("origin") = py::none(),
             py::arg("direction") = py::none(), py::arg("unit") = "")
        .def_property_readonly("array", voxels_of, "(nz, ny, nx), read-only; a view of the image if it is in memory.")
        .def(
            "__array__",
            [](const Image& image, const py::object& dtype) {
                const py::array array = voxels_of(image);
                return dtype.is_none() ? py::object(array) : array.attr("astype")(dtype);
            },
            py::arg("dtype") = py::none())
        .def_property_readonly(
            "shape", [](const Image& image) { return shape_of(image.held().size()); }, "(nz, ny, nx)")
        .def_property_readonly(
            "dtype",
            [](const Image& image) {
                const std::string name = to_string(image.pixel_type());
                return py::dtype(name == "float" ? "float32" : name == "double" ? "float64" : name);
            },
            "Type of the voxels.")
        .def_property_readonly(
            "spacing", [](const Image& image) { return from_vec3(image.geometry().spacing); },
            "Spacing along (x, y, z) in world units.")
        .def_property_readonly(
            "origin", [](const Image& image) { return from_vec3(image.geometry().origin); },
            "Position (x, y, z) of the centre of voxel 0 in world units.")
        .def_property_readonly(
            "direction", [](const Image& image) { return from_matrix(image.geometry().direction); },
            "3 x 3; its columns are the axes of i, j, k.")
        .def_property_readonly(
            "unit", [](const Image& image) { return image.geometry().unit; },
            "Unit of the world, for example 'um'; empty if it is not stated.")
        .def_property_readonly(
            "spacing_known", [](const Image& image) { return image.geometry().spacing_known; },
            "False along axes for which the file states no spacing, so that 1 is used.")
        .def_property_readonly("path", &Image::path, "Path of the file; empty for an image in memory.")
        .def(
            "index_to_world",
            [](const Image& image, const py::object& zyx) {
                std::vector<Vec3> places = to_positions("index", zyx);
                for (Vec3& p : places) p = image.geometry().index_to_world({p[2], p[1], p[0]});
                return from_positions(places);
            },
            py::arg("index"), "Positions (x, y, z), shape (n, 3), of voxels (z, y, x), shape (n, 3).")
        .def(
            "world_to_index",
            [](const Image& image, const py::object& xyz) {
                std::vector<Vec3> places = to_positions("world", xyz);
                for (Vec3& p : places) {
                    const Vec3 index = image.geometry().world_to_index(p);
                    p = {index[2], index[1], index[0]};
                }
                return from_positions(places);
            },
            py::arg("world"), "Voxels (z, y, x), shape (n, 3), of positions (x, y, z), shape (n, 3).");
    module.def("read_image", read);
    module.def("phantom", make_test_shape);
}

void add_points(py::module_& module) {
    py::class_<PointCloud>(module, "Points", "Marks or a cloud, as they are stored in a file: see read_points().")
        .def(py::init(&make_points))
        .def("__len__", [](const PointCloud& cloud) { return cloud.points.size(); })
        .def_property_readonly(
            "array", [](const PointCloud& cloud) { return from_positions(cloud.points); },
            "(n, 3), x, y, z in `space`.")
        .def(
            "__array__",
            [](const PointCloud& cloud, const py::object& dtype) {
                const py::array array = from_positions(cloud.points);
                return dtype.is_none() ? py::object(array) : array.attr("astype")(dtype);
            },
            py::arg("dtype") = py::none())
        .def_property_readonly(
            "normals",
            [](const PointCloud& cloud) -> py::object {
                if (cloud.normals.empty()) return py::none();
                return from_positions(cloud.normals);
            },
            "(n, 3), unit vectors, 0 for points without one; None without normals.")
        .def_property_readonly(
            "lines",
            [](const PointCloud& cloud) {
                py::list all;
                for (const MarkLine& line : cloud.lines) {
                    const auto begin = cloud.points.begin();
                    all.append(from_positions({begin + static_cast<std::ptrdiff_t>(line.begin),
                                               begin + static_cast<std::ptrdiff_t>(line.end)}));
                }
                return all;
            },
            "Points of each contour: a list of arrays (n, 3).")
        .def_property_readonly(
            "space", [](const PointCloud& cloud) { return space_name(cloud.space); },
            "'world', 'index', 'local' or 'slices'.")
        .def_readonly("rule", &PointCloud::rule, "How the coordinates were interpreted.")
        .def_readonly("source", &PointCloud::source, "The file.")
        .def(
            "to_world",
            [](const PointCloud& cloud, const Image* image) {
                return from_positions(image != nullptr ? to_world(cloud, image->geometry()) : to_world(cloud));
            },
            py::arg("image") = nullptr,
            "(n, 3), x, y, z in the world; positions in voxels require the image. Raises Error.");
    module.def("read_points", [](const std::string& path, const py::object& space, const py::object& order,
                                 double scale, int channels) {
        const ReadPointsOptions reading = make_reading(space, order, scale, channels);
        const py::gil_scoped_release released;
        return read_points(path, reading);
    });
    module.def("read_study", marks_of_study);
    module.def("read_study_options", options_of_study);
}

}  // namespace covol::python
