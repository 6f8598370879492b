#pragma once
#include <string>

#include "covol/points.h"

/// How a file's coordinates become positions. A reading here has every field stated.
namespace covol::detail {

/// The space of what read_as() returns.
[[nodiscard]] PointSpace space_after(PointSpace read_as);
/// A file's coordinates as a position in space_after(reading.space).
[[nodiscard]] Vec3 read_as(const ReadPointsOptions& reading, Vec3 p);
/// Likewise of a direction; @pre space_after(reading.space) is World.
[[nodiscard]] Vec3 direction_as(const ReadPointsOptions& reading, Vec3 v);
/// What the file says of a position; @pre reading.channels == 1.
[[nodiscard]] Vec3 undo(const ReadPointsOptions& reading, Vec3 p);
/// "z, y, x in voxels"
[[nodiscard]] std::string describe(const ReadPointsOptions& reading);

}  // namespace covol::detail
