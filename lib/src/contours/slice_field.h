#pragma once
#include <array>
#include <cstddef>
#include <vector>

namespace covol::detail {

using Vec2 = std::array<double, 2>;
using Polygon = std::vector<Vec2>;  ///< closed: the last vertex joins the first

/// A lattice in a plane: node (i,j) at origin + cell * (i,j).
struct SliceGrid {
    Vec2 origin{0, 0};
    double cell = 1;
    int nx = 0, ny = 0;
    [[nodiscard]] std::size_t size() const { return std::size_t(nx) * std::size_t(ny); }
};

/// Signed distance to the polygons at the grid's nodes (i fastest), negative inside by the even-odd rule over all of
/// them. Exact beside the polygons; elsewhere the distance to the nearest edge found by two sweeps over the grid, which
/// is almost always the nearest one.
[[nodiscard]] std::vector<float> signed_distance_of_polygons(const std::vector<Polygon>& polygons,
                                                             const SliceGrid& grid);

/// A position in a grid's plane, computed once for all slices.
struct SlicePlace {
    std::size_t node = 0;  ///< the node with the lowest indices of the cell's four
    double s = 0, t = 0;   ///< position within the cell, 0 to 1
    double beyond = 0;     ///< distance from the grid, in units of x and y; 0 within it
};
[[nodiscard]] SlicePlace place_in(const SliceGrid& grid, double x, double y);

/// Bilinear interpolation within the grid; beyond it, the value at its border plus the distance from the grid.
[[nodiscard]] inline double sample_slice(const std::vector<float>& values, const SliceGrid& grid, const SlicePlace& p) {
    const float *row = values.data() + p.node, *next = row + grid.nx;
    return (1 - p.t) * ((1 - p.s) * double(row[0]) + p.s * double(row[1])) +
           p.t * ((1 - p.s) * double(next[0]) + p.s * double(next[1])) + p.beyond;
}

/// Area by the shoelace formula, and the centroid, which is the mean of the vertices if the area is 0.
struct PolygonMoments {
    double area = 0;
    Vec2 centroid{0, 0};
};
[[nodiscard]] PolygonMoments moments(const Polygon& polygon);

}  // namespace covol::detail
