#pragma once
#include <array>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/options_table.h"
#include "covol/points.h"

namespace covol {

/// What a mark says of its place: it lies on the structure's surface, in the structure, or outside of it.
enum class MarkKind { Surface, Inside, Outside };
template <>
inline constexpr auto kWords<MarkKind> = std::array{"surface", "inside", "outside"};

/// A file of marks, and the kind of each where a column `kind` of its table tells it.
struct KindedPoints {
    PointCloud cloud;
    std::vector<MarkKind> kinds;  ///< one for each point; empty: the file tells none, all lie on the surface

    /// The points of that kind alone. Those of a file without kinds are all surface, and keep their lines.
    [[nodiscard]] COVOL_API PointCloud of(MarkKind kind) const;
};

/// As read_points(), with the kinds. @throws  as read_points()
[[nodiscard]] COVOL_API KindedPoints read_kinded_points(const std::string& path, const ReadPointsOptions& options = {});

}  // namespace covol
