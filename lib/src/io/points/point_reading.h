#pragma once
#include <string>

#include "covol/points.h"

/// Conversion of a file's coordinates to positions. Every field of a reading is set here.
namespace covol::detail {

/// The space of the result of read_as().
[[nodiscard]] PointSpace space_after(PointSpace read_as);
/// Converts a file's coordinates to a position in space_after(reading.space).
[[nodiscard]] Vec3 read_as(const ReadPointsOptions& reading, Vec3 p);
/// The same for a direction; @pre space_after(reading.space) is World.
[[nodiscard]] Vec3 direction_as(const ReadPointsOptions& reading, Vec3 v);
/// The inverse of read_as(): the file's coordinates of a position; @pre reading.channels == 1.
[[nodiscard]] Vec3 undo(const ReadPointsOptions& reading, Vec3 p);
/// "z, y, x in voxels"
[[nodiscard]] std::string describe(const ReadPointsOptions& reading);

}  // namespace covol::detail
