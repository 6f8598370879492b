#pragma once
#include <string>

#include "covol/points.h"

/// Conversion of a file's coordinates to positions. The functions require that no member of `reading` is Unstated.
namespace covol::detail {

/// The coordinate system of the result of read_as() for coordinates in the system `read_as`.
[[nodiscard]] PointSpace space_after(PointSpace read_as);
/// Converts a file's coordinates to a position in space_after(reading.space).
[[nodiscard]] Vec3 read_as(const ReadPointsOptions& reading, Vec3 p);
/// Converts a direction as read_as() converts positions. @pre space_after(reading.space) is World.
[[nodiscard]] Vec3 direction_as(const ReadPointsOptions& reading, Vec3 v);
/// The inverse of read_as(): the file's coordinates of a position; @pre reading.channels == 1.
[[nodiscard]] Vec3 undo(const ReadPointsOptions& reading, Vec3 p);
/// Describes a reading for users, for example as "z, y, x in voxels".
[[nodiscard]] std::string describe(const ReadPointsOptions& reading);

}  // namespace covol::detail
