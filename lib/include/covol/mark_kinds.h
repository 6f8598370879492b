#pragma once
#include <array>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/options_table.h"
#include "covol/points.h"

namespace covol {

/// The position of a mark: on the structure's surface, inside the structure, or outside of it.
enum class MarkKind { Surface, Inside, Outside };
template <>
inline constexpr auto kWords<MarkKind> = std::array{"surface", "inside", "outside"};

/// A file of marks, with the kind of each mark if its table has a column `kind`.
struct KindedPoints {
    PointCloud cloud;
    std::vector<MarkKind> kinds;  ///< one for each point; empty: the file states none, all lie on the surface

    /// Only the points of that kind. Those of a file without kinds are all on the surface, and keep their lines.
    [[nodiscard]] COVOL_API PointCloud of(MarkKind kind) const;
};

/// As read_points(), with the kinds. @throws  as read_points()
[[nodiscard]] COVOL_API KindedPoints read_kinded_points(const std::string& path, const ReadPointsOptions& options = {});

}  // namespace covol
