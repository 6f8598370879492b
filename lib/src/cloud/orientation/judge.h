#pragma once
// Measures of the quality of an orientation, and the cell sizes of its grids.
#include <vector>

#include "covol/orientation.h"

namespace covol::cloud {

/// Smallest cell size that the points allow for the indicator, world units: at least the noise; larger if there are
/// more points than the iteration uses.
/// @param points  number of points
[[nodiscard]] double finest_cell(const CloudScale& scale, std::size_t points);
/// The longest side of the bounding box of the cloud or, if the cloud consists of parts that are far apart compared to
/// their size, of its largest part, world units; 0 if the points have no spacing.
[[nodiscard]] double part_side(const std::vector<Vec3>& points, const CloudScale& scale);
/// Cell size of the indicator's finest grid in the first attempt of orient(), world units: at least finest_cell(), and
/// at most kOrientation.first_along cells along the largest part. On larger cells, fewer normals change their sides
/// during the iteration; later attempts have smaller cells for thin parts.
/// @param part  part_side()
[[nodiscard]] double first_cell(const CloudScale& scale, double part, std::size_t points);

/// Whether the noise is small compared to the spacing, so that the nearest points are on the sheet of a point, not
/// above or below it.
[[nodiscard]] bool is_clean(const CloudScale& scale);

/// Distance from which on points are not of one sheet: their spacing or, if that is larger, their noise; world units.
[[nodiscard]] double apart(const CloudScale& scale);
/// Edge of cells of which hardly any that the surface crosses is empty, world units: kCloud.coarse times apart(). A
/// position farther than this from every point is bare.
[[nodiscard]] double coarse_cell(const CloudScale& scale);
/// Distance between a point and a surface above which the surface counts as missing the point, world units.
[[nodiscard]] double miss_reach(const CloudScale& scale);

/// Measure of doubt in an orientation: the fraction of normals that changed their side in the last iteration, plus a
/// penalty if the mean of the indicator at the points differs from 1/2, as it does if whole parts are inverted.
[[nodiscard]] double doubt(const Orientation& orientation);
[[nodiscard]] bool is_settled(const Orientation& orientation);

/// Fraction of the points that are farther than `reach`, world units, from the indicator's level 1/2, to first order.
[[nodiscard]] double fraction_missed(const Indicator& indicator, const std::vector<Vec3>& points, double reach);

}  // namespace covol::cloud
