#pragma once
#include <array>
#include <vector>

#include "mesh/triangle.h"

// Normals at vertices: the sum of the triangles' unit normals, weighted by the angle at the vertex.
namespace covol::meshing {

/// The contribution of a triangle to the sum of normals at each of its corners; 0 for a triangle without area.
[[nodiscard]] std::array<Vec3, 3> corner_normals(const std::array<Vec3, 3>& corners);
void add_normals(const std::array<Vec3, 3>& normals, const std::array<Vec3*, 3>& sums);
[[nodiscard]] std::array<float, 3> unit_normal(const Vec3& sum);
/// compute_vertex_normals() of separate vertices and triangles.
[[nodiscard]] std::vector<std::array<float, 3>> vertex_normals(const std::vector<std::array<float, 3>>& vertices,
                                                               const std::vector<Triangle>& triangles);

}  // namespace covol::meshing
