#pragma once
#include <memory>
#include <string>
#include <vector>

#include "call.h"
#include "covol/compare.h"
#include "covol/mesh_io.h"
#include "solve.h"

// The module's types. The shapes of arguments and results are documented in covol/__init__.pyi.
namespace covol::python {

struct Mesh {
    std::shared_ptr<const TriangleMesh> triangles;
    std::vector<VertexAttribute> attributes;
};

void add_image(py::module_& module);
void add_points(py::module_& module);
void add_surfaces(py::module_& module);
void add_jobs(py::module_& module);

/// Converts JSON text to Python objects.
[[nodiscard]] py::object from_json(const std::string& text);

}  // namespace covol::python
