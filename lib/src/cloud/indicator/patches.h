#pragma once
// Connected parts of a cloud whose normals may all be reversed.
#include <cstdint>
#include <vector>

#include "points/point_cells.h"

namespace covol::cloud {

/// For each cell, its neighbouring cells that contain points.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> neighbours_of(const PointCells& cells);

/// For each cell, the number of its patch, from 0; -1 for cells with side 0. A patch consists of connected cells with
/// the same value of `side`.
/// @param beside  the result of neighbours_of()
/// @param side    for each cell, the value by which patches are formed; 0 if the cell belongs to no patch
[[nodiscard]] std::vector<int> patches_of(const std::vector<std::vector<std::uint32_t>>& beside,
                                          const std::vector<int>& side);

/// Calls visit(cell, index of the point in the input) for all points.
template <typename Visit>
void for_points_of(const PointCells& cells, Visit visit) {
    for (std::size_t cell = 0; cell < cells.cell_count(); ++cell)
        for (std::uint32_t at = cells.cell(cell).begin; at < cells.cell(cell).end; ++at) visit(cell, cells.order()[at]);
}

}  // namespace covol::cloud
