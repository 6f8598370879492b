#pragma once
#include <array>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/options_table.h"
#include "covol/points.h"

namespace covol {

/// Whether a mark lies on the structure's surface, inside the structure, or outside of it.
enum class MarkKind { Surface, Inside, Outside };
template <>
inline constexpr auto kWords<MarkKind> = std::array{"surface", "inside", "outside"};

/// A file of marks, with the kind of each mark if its table has a column `kind`.
struct KindedPoints {
    PointCloud cloud;
    /// one for each point; empty: the file states no kinds, and all points are on the surface
    std::vector<MarkKind> kinds;

    /// Only the points of that kind. For a file without kinds, Surface gives the whole cloud with its lines.
    [[nodiscard]] COVOL_API PointCloud of(MarkKind kind) const;
};

/// Reads points as read_points() does, together with their kinds. @throws  as read_points()
[[nodiscard]] COVOL_API KindedPoints read_kinded_points(const std::string& path, const ReadPointsOptions& options = {});

}  // namespace covol
