#pragma once
// The indicator of a cloud's solid, as orient() leaves it.
#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// The longest side of what the indicator is found in.
[[nodiscard]] double indicator_side(const std::vector<Vec3>& points);
/// That cell, or a smaller one, so that the longest side has a fair number of them.
[[nodiscard]] double indicator_cell(const std::vector<Vec3>& points, double cell);
/// Around the points, so much wider that the indicator is 0 at its end; coarser where the points are sparse.
/// @param areas  of the surface that each point stands for; empty: the same for all
[[nodiscard]] std::shared_ptr<const GridStack> indicator_grid(const std::vector<Vec3>& points,
                                                              const std::vector<double>& areas, double cell);

/// The same of exactly that cell.
[[nodiscard]] std::shared_ptr<const GridStack> grid_around(const std::vector<Vec3>& points,
                                                           const std::vector<double>& areas, double cell);

/// The indicator of normals and areas, from the field's last solution.
void solve(WindingField& field, const std::vector<Vec3>& points, const Orientation& orientation, int cycles,
           const RunContext& run);

/// Half of the indicator's step is at the points, whichever way they are turned. @return the factor
double scale_to_half(WindingField& field, const std::vector<Vec3>& points);

/// Of the indicator, over the points.
[[nodiscard]] double mean_at(const WindingField& field, const std::vector<Vec3>& points);

/// The share of the cells which the indicator's surface passes that have no point within `reach` of their middle.
[[nodiscard]] double bare_fraction(const Indicator& indicator, const std::vector<Vec3>& points, double reach);

[[nodiscard]] std::shared_ptr<const Indicator> make_indicator(StackField field);
[[nodiscard]] std::shared_ptr<const Indicator> make_indicator(const WindingField& field);

/// The indicator of normals as they are, on cells of another size.
[[nodiscard]] std::shared_ptr<const Indicator> indicator_of(const std::vector<Vec3>& points,
                                                            const Orientation& orientation, double cell,
                                                            const RunContext& run);

}  // namespace covol::cloud
