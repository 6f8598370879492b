#pragma once
// The indicator of a cloud's solid, as computed by orient().
#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// The longest side of the box in which the indicator is computed.
/// @param longest  longest side of the points' box
[[nodiscard]] double indicator_side(double longest);
/// `cell`, or a smaller cell size if the longest side of the indicator's box, indicator_side(), would have fewer than
/// kIndicator.min_cells cells.
[[nodiscard]] double indicator_cell(const std::vector<Vec3>& points, double cell);
/// Grids around the points, coarser where the points are sparse, with a margin so wide that the indicator may be set to
/// 0 at its end. The cell size is that of indicator_cell().
/// @param areas  area of the surface that each point represents; empty: the finest grid is used around all points
[[nodiscard]] std::shared_ptr<const GridStack> indicator_grid(const std::vector<Vec3>& points,
                                                              const std::vector<double>& areas, double cell);

/// The grids of indicator_grid(), but with exactly the given cell size.
[[nodiscard]] std::shared_ptr<const GridStack> grid_around(const std::vector<Vec3>& points,
                                                           const std::vector<double>& areas, double cell);

/// Computes the indicator of the given normals and areas, starting from the field's last solution.
void solve(WindingField& field, const std::vector<Vec3>& points, const Orientation& orientation, int cycles,
           const RunContext& run);

/// Scales the field so that the median of its absolute value at the points is 1/2. @return the factor
double scale_to_half(WindingField& field, const std::vector<Vec3>& points);

/// The mean of the indicator over the points.
[[nodiscard]] double mean_at(const WindingField& field, const std::vector<Vec3>& points);

/// The fraction, by area, of the cells crossed by the indicator's surface that have no point within `reach` of their
/// centre.
[[nodiscard]] double bare_fraction(const Indicator& indicator, const std::vector<Vec3>& points, double reach);

[[nodiscard]] std::shared_ptr<const Indicator> make_indicator(StackField field);
[[nodiscard]] std::shared_ptr<const Indicator> make_indicator(const WindingField& field);

/// The indicator of the orientation's normals and areas, computed with the cell size indicator_cell(points, cell).
[[nodiscard]] std::shared_ptr<const Indicator> indicator_of(const std::vector<Vec3>& points,
                                                            const Orientation& orientation, double cell,
                                                            const RunContext& run);

}  // namespace covol::cloud
