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

/// A read-only array that is a view of memory of `owner`, and keeps it alive.
template <typename T, typename Owner>
py::array show(const T* data, const std::vector<py::ssize_t>& shape, const std::vector<py::ssize_t>& strides,
               std::shared_ptr<Owner> owner) {
    using Kept = std::shared_ptr<Owner>;
    const py::capsule keeper(new Kept(std::move(owner)), [](void* kept) { delete static_cast<Kept*>(kept); });
    py::array array(py::dtype::of<T>(), shape, strides, data, keeper);
    array.attr("flags").attr("writeable") = false;
    return array;
}

/// A writable array that takes over the values, without a copy.
template <typename T>
py::array give(std::vector<T>&& values, const std::vector<py::ssize_t>& shape) {
    const auto kept = new std::vector<T>(std::move(values));
    const py::capsule keeper(kept, [](void* v) { delete static_cast<std::vector<T>*>(v); });
    return py::array(py::dtype::of<T>(), shape, kept->data(), keeper);
}

[[nodiscard]] Vec3 to_vec3(const char* name, const py::handle& value);
[[nodiscard]] py::tuple from_vec3(const Vec3& v);
/// A matrix whose columns are the axes of the image, from nine numbers in row-major order, or from a 3 x 3 array.
[[nodiscard]] Matrix3 to_matrix(const char* name, const py::handle& value);
[[nodiscard]] py::array from_matrix(const Matrix3& m);
/// Positions from an array of shape (n, 3), or (3) for one position, of any number type. @throws Error InvalidInput.
[[nodiscard]] std::vector<Vec3> to_positions(const char* name, const py::handle& value);
[[nodiscard]] py::array from_positions(const std::vector<Vec3>& positions);

/// An image that uses the array's own memory if the number type is supported by covol, in this machine's byte order and
/// aligned; otherwise a copy. @throws Error InvalidInput, Unsupported.
[[nodiscard]] Image to_image(const py::handle& array, ImageGeometry geometry);
/// The loaded voxels as an array: a view if the image is in memory, otherwise a copy.
[[nodiscard]] py::array voxels_of(const Image& image);
[[nodiscard]] py::tuple shape_of(const Index3& size);

[[nodiscard]] TriangleMesh to_mesh(const py::handle& vertices, const py::handle& faces);

}  // namespace covol::python
