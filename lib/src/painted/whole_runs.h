#pragma once
#include <optional>

#include "covol/image.h"
#include "painted/paint.h"

namespace covol::painted {

/// The axis across which paint on adjacent slices shows complete cross-sections, or none.
///
/// Paint by a brush tapers off in all directions: it is a ball, or a ball that was dragged along. Slices that were
/// painted one by one have blunt ends across the axis of the slices: if the paint's sections are extrapolated as those
/// of an ellipsoid, the next slice should contain paint, but does not. Each connected piece that is wider than a stroke
/// is tested; pieces with more than half of the paint have to be blunt. Of several such axes the one with the widest
/// ends is chosen, and the last of equally wide ones; but paint that is equally long in all directions, such as a cube,
/// gives no axis. An end at the image's end is not considered, but paint through all of the image is not by a brush.
[[nodiscard]] std::optional<int> find_whole_runs(const Paint& paint, const ImageGeometry& geometry);

}  // namespace covol::painted
