#include "arrays.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "covol/error.h"

namespace covol::python {
namespace {

std::string text_of(const py::handle& value) { return py::cast<std::string>(py::str(value)); }

[[noreturn]] void bad(const std::string& name, const std::string& expected, const std::string& got) {
    throw Error(Errc::InvalidInput, name + ": expected " + expected + ", got " + got, name);
}

/// Converts an array of any numbers to a contiguous array of doubles in row-major order.
py::array_t<double> to_doubles(const char* name, const std::string& expected, const py::handle& value) {
    auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
    if (!array) {
        PyErr_Clear();
        bad(name, expected, text_of(py::type::of(value)));
    }
    return array;
}

std::string shape_text(const py::array& array) { return "an array of shape " + text_of(array.attr("shape")); }

constexpr struct {
    char kind;
    int bytes;
    PixelType type;
} kKnown[] = {{'u', 1, PixelType::UInt8}, {'i', 1, PixelType::Int8},   {'u', 2, PixelType::UInt16},
              {'i', 2, PixelType::Int16}, {'u', 4, PixelType::UInt32}, {'i', 4, PixelType::Int32},
              {'f', 4, PixelType::Float}, {'f', 8, PixelType::Double}};

/// The array, converted if necessary to a number type that covol supports and to the byte order of this machine.
/// @throws Error Unsupported if its elements are not integers, floats or Booleans.
py::array known_numbers(py::array array) {
    const char kind = array.dtype().kind();
    const auto bytes = array.dtype().itemsize();
    const auto converted = [&](const char* type) -> py::array { return array.attr("astype")(type); };
    if (kind == 'b') return array.attr("view")("uint8");
    if (kind == 'f' && bytes == 2) return converted("float32");
    if (kind == 'f' && bytes > 8) return converted("float64");
    if ((kind == 'i' || kind == 'u') && bytes == 8) {
        // covol does not support 64-bit integers. Labels and counts usually fit into 32 bits; other values become
        // doubles.
        const double low = py::cast<double>(array.attr("min")()), high = py::cast<double>(array.attr("max")());
        const bool fits =
            low >= std::numeric_limits<std::int32_t>::min() && high <= std::numeric_limits<std::int32_t>::max();
        return converted(fits ? "int32" : "float64");
    }
    if (kind != 'i' && kind != 'u' && kind != 'f')
        throw Error(Errc::Unsupported,
                    "image: expected an array of integers, floats or bools, got " + text_of(array.dtype()), "image");
    if (!py::cast<bool>(array.attr("dtype").attr("isnative")))
        return array.attr("astype")(array.attr("dtype").attr("newbyteorder")("="));
    return array;
}

bool is_whole(const py::array& array) {
    const auto bytes = static_cast<py::ssize_t>(array.itemsize());
    for (int a = 0; a < 3; ++a)
        if (array.strides(a) % bytes != 0) return false;
    return py::cast<bool>(array.attr("flags").attr("aligned"));
}

/// A pointer to `first` that keeps the array alive. It may be released on any thread, because it acquires the GIL
/// first.
std::shared_ptr<const void> keep(const void* first, py::array array) {
    const auto owner = new py::array(std::move(array));
    return {first, [owner](const void*) {
                const py::gil_scoped_acquire held;
                delete owner;
            }};
}

}  // namespace

Vec3 to_vec3(const char* name, const py::handle& value) {
    const py::array_t<double> v = to_doubles(name, "three numbers", value);
    if (v.size() != 3) bad(name, "three numbers", text_of(value));
    return {v.data()[0], v.data()[1], v.data()[2]};
}

py::tuple from_vec3(const Vec3& v) { return py::make_tuple(v[0], v[1], v[2]); }

Matrix3 to_matrix(const char* name, const py::handle& value) {
    const py::array_t<double> v = to_doubles(name, "a 3 x 3 matrix", value);
    if (v.size() != 9) bad(name, "a 3 x 3 matrix", shape_text(v));
    Matrix3 m;
    for (int n = 0; n < 9; ++n) m[n / 3][n % 3] = v.data()[n];
    return m;
}

py::array from_matrix(const Matrix3& m) {
    std::vector<double> values;
    for (const auto& row : m) values.insert(values.end(), row.begin(), row.end());
    return give(std::move(values), {3, 3});
}

std::vector<Vec3> to_positions(const char* name, const py::handle& value) {
    const std::string expected = "positions of shape (n, 3)";
    const py::array_t<double> v = to_doubles(name, expected, value);
    if (v.size() == 0) return {};
    const bool one = v.ndim() == 1 && v.size() == 3;
    if (!one && (v.ndim() != 2 || v.shape(1) != 3)) bad(name, expected, shape_text(v));
    std::vector<Vec3> positions(static_cast<std::size_t>(v.size() / 3));
    for (std::size_t n = 0; n < positions.size(); ++n)
        for (std::size_t a = 0; a < 3; ++a) {
            positions[n][a] = v.data()[3 * n + a];
            if (!std::isfinite(positions[n][a])) bad(name, "finite numbers", "nan or inf in row " + std::to_string(n));
        }
    return positions;
}

py::array from_positions(const std::vector<Vec3>& positions) {
    std::vector<double> values;
    values.reserve(3 * positions.size());
    for (const Vec3& p : positions) values.insert(values.end(), p.begin(), p.end());
    return give(std::move(values), {static_cast<py::ssize_t>(positions.size()), 3});
}

Image to_image(const py::handle& given, ImageGeometry geometry) {
    py::array array = py::array::ensure(given);
    if (!array) {
        PyErr_Clear();
        bad("image", "an array", text_of(py::type::of(given)));
    }
    if (array.ndim() != 3) bad("image", "an array of three axes, z, y, x", shape_text(array));
    if (array.size() == 0) bad("image", "voxels", shape_text(array));
    array = known_numbers(std::move(array));
    if (!is_whole(array)) array = py::array(array.attr("copy")());
    for (int a = 0; a < 3; ++a) {
        if (array.shape(2 - a) > std::numeric_limits<std::int32_t>::max())
            bad("image", "at most 2147483647 voxels along each axis", shape_text(array));
        geometry.size[a] = static_cast<std::int32_t>(array.shape(2 - a));
    }
    VoxelView view;
    for (const auto& known : kKnown)
        if (array.dtype().kind() == known.kind && array.itemsize() == known.bytes) view.type = known.type;
    const auto bytes = static_cast<py::ssize_t>(array.itemsize());
    for (int a = 0; a < 3; ++a) view.stride[a] = array.strides(2 - a) / bytes;
    const void* const first = array.data();
    view.first = keep(first, std::move(array));
    return Image::from_view(geometry, view);
}

py::tuple shape_of(const Index3& size) { return py::make_tuple(size[2], size[1], size[0]); }

py::array voxels_of(const Image& image) {
    const Index3 size = image.held().size();
    const std::vector<py::ssize_t> shape{size[2], size[1], size[0]};
    const std::optional<VoxelView> view = image.view();
    const auto make = [&]<typename T>(T) -> py::array {
        if (view) {
            std::vector<py::ssize_t> strides;
            for (int a = 2; a >= 0; --a) strides.push_back(static_cast<py::ssize_t>(view->stride[a] * sizeof(T)));
            return show(static_cast<const T*>(view->first.get()), shape, strides, view->first);
        }
        std::vector<T> values(std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]));
        {
            const py::gil_scoped_release released;
            image.load(image.held());
            if constexpr (sizeof(T) <= 2 || std::is_same_v<T, float>) {
                std::vector<float> exact(values.size());
                image.copy(image.held(), exact.data());
                std::transform(exact.begin(), exact.end(), values.begin(), [](float v) { return static_cast<T>(v); });
            } else {
                auto value = values.begin();
                const VoxelBox& box = image.held();
                for (int k = box.min[2]; k <= box.max[2]; ++k)
                    for (int j = box.min[1]; j <= box.max[1]; ++j)
                        for (int i = box.min[0]; i <= box.max[0]; ++i) *value++ = static_cast<T>(image.at(i, j, k));
            }
        }
        return give(std::move(values), shape);
    };
    switch (image.pixel_type()) {
        case PixelType::UInt8: return make(std::uint8_t{});
        case PixelType::Int8: return make(std::int8_t{});
        case PixelType::UInt16: return make(std::uint16_t{});
        case PixelType::Int16: return make(std::int16_t{});
        case PixelType::UInt32: return make(std::uint32_t{});
        case PixelType::Int32: return make(std::int32_t{});
        case PixelType::Float: return make(float{});
        case PixelType::Double: break;
    }
    return make(double{});
}

TriangleMesh to_mesh(const py::handle& vertices, const py::handle& faces) {
    TriangleMesh mesh;
    const std::vector<Vec3> places = to_positions("vertices", vertices);
    if (!places.empty()) {
        const WorldBox box = bounding_box(places);
        mesh.origin = choose_mesh_origin(box, longest_side(box) / 100);
    }
    for (const Vec3& v : places)
        mesh.vertices.push_back({static_cast<float>(v[0] - mesh.origin[0]), static_cast<float>(v[1] - mesh.origin[1]),
                                 static_cast<float>(v[2] - mesh.origin[2])});
    const auto count = static_cast<double>(mesh.vertices.size());
    for (const Vec3& f : to_positions("faces", faces)) {
        std::array<std::uint32_t, 3> triangle{};
        for (std::size_t c = 0; c < 3; ++c) {
            if (!(f[c] >= 0 && f[c] < count) || f[c] != std::floor(f[c]))
                bad("faces", "indices of vertices, 0 to " + std::to_string(std::int64_t(mesh.vertices.size()) - 1),
                    std::to_string(f[c]));
            triangle[c] = static_cast<std::uint32_t>(f[c]);
        }
        mesh.triangles.push_back(triangle);
    }
    return mesh;
}

}  // namespace covol::python
