#pragma once
#include <optional>

#include "covol/image.h"
#include "painted/paint.h"

namespace covol::painted {

/// The axis across which paint on adjacent slices shows complete cross-sections, or none.
///
/// Paint by a brush tapers off in all directions, because a brush is a ball or a ball that is dragged along. Slices
/// that were painted one by one have blunt ends: if the sections are extrapolated as those of an ellipsoid, the next
/// slice should contain paint, but does not. Connected pieces that are wider than a stroke are tested, and those that
/// are blunt along an axis must contain more than half of the paint. Of several such axes the one with the widest ends
/// is chosen, and the last of equally wide ones; but paint that is equally long in all directions, such as a cube,
/// gives no axis. Ends at the image's end are not tested; paint that extends through the whole image counts as blunt.
[[nodiscard]] std::optional<int> find_whole_runs(const Paint& paint, const ImageGeometry& geometry);

}  // namespace covol::painted
