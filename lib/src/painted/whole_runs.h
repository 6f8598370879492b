#pragma once
#include <optional>

#include "covol/image.h"
#include "painted/paint.h"

namespace covol::painted {

/// The axis across which paint on adjacent slices shows whole cross-sections, or none.
///
/// A brush leaves paint that tapers off everywhere: a ball, or a ball that was dragged along. Slices that were painted
/// one by one end bluntly across the axis of the slices: the sections of the paint, carried on as those of an
/// ellipsoid, would go on in the next slice, and nothing is painted there. That is asked of each connected piece that
/// is wider than a stroke; pieces that hold more than half of the paint have to say so. Of several axes it is the one
/// whose ends are the widest, of equally wide ones the last; paint that is as long in all directions, as a cube of it
/// is, says nothing. An end at the image's end says nothing either, but paint through all of the image is no brush's.
[[nodiscard]] std::optional<int> find_whole_runs(const Paint& paint, const ImageGeometry& geometry);

}  // namespace covol::painted
