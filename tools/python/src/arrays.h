#pragma once
#include <pybind11/numpy.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "call.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/points.h"

// Arrays are indexed z, y, x; positions, spacings and origins are x, y, z.
namespace covol::python {

/// An array that shows memory which `owner` keeps; nobody writes to it.
template <typename T, typename Owner>
py::array show(const T* data, const std::vector<py::ssize_t>& shape, const std::vector<py::ssize_t>& strides,
               std::shared_ptr<Owner> owner) {
    using Kept = std::shared_ptr<Owner>;
    const py::capsule keeper(new Kept(std::move(owner)), [](void* kept) { delete static_cast<Kept*>(kept); });
    py::array array(py::dtype::of<T>(), shape, strides, data, keeper);
    array.attr("flags").attr("writeable") = false;
    return array;
}

/// The same, of values without gaps that the array takes over and may change.
template <typename T>
py::array give(std::vector<T>&& values, const std::vector<py::ssize_t>& shape) {
    const auto kept = new std::vector<T>(std::move(values));
    const py::capsule keeper(kept, [](void* v) { delete static_cast<std::vector<T>*>(v); });
    return py::array(py::dtype::of<T>(), shape, kept->data(), keeper);
}

[[nodiscard]] Vec3 to_vec3(const char* name, const py::handle& value);
[[nodiscard]] py::tuple from_vec3(const Vec3& v);
/// Rows; columns are the image's axes. Nine numbers in a row, or 3 x 3.
[[nodiscard]] Matrix3 to_matrix(const char* name, const py::handle& value);
[[nodiscard]] py::array from_matrix(const Matrix3& m);
/// (n, 3), of any numbers; one position is one row. @throws Error InvalidInput.
[[nodiscard]] std::vector<Vec3> to_positions(const char* name, const py::handle& value);
[[nodiscard]] py::array from_positions(const std::vector<Vec3>& positions);

/// An image over the array's own memory where its numbers are of a kind that covol knows, in this machine's byte order
/// and aligned; a copy where not. @throws Error InvalidInput, Unsupported.
[[nodiscard]] Image to_image(const py::handle& array, ImageGeometry geometry);
/// The held voxels; a view where they lie in memory.
[[nodiscard]] py::array voxels_of(const Image& image);
[[nodiscard]] py::tuple shape_of(const Index3& size);

[[nodiscard]] TriangleMesh to_mesh(const py::handle& vertices, const py::handle& faces);

}  // namespace covol::python
