#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "covol/mark_kinds.h"
#include "covol/points.h"

namespace covol::detail {

/// The contents of a point file; the coordinates are in the file's own order and coordinate system.
struct PointTable {
    std::vector<Vec3> points;
    std::vector<MarkLine> lines;
    std::vector<MarkKind> kinds;  ///< empty, or one for each point
    std::vector<Vec3> normals;    ///< empty, or one for each point, normalized by normal_of()
    std::optional<Vec3> sensor;
    PointSpace space = PointSpace::Unstated;
    PointOrder order = PointOrder::Unstated;
    /// Unit of lengths, as returned by normal_unit(); empty if the file states none.
    std::string unit;
    std::vector<std::string> structures;   ///< names of the marks' structures, in the file's order
    std::vector<std::uint32_t> structure;  ///< index of each point's structure; empty if structures were not requested
    std::string rule;                      ///< text for users: the columns or elements that were used
};

/// Chooses the reader by the file name's extension.
/// @param structures_by  as in read_structures_of_points(); empty: structures are ignored
/// @throws as read_points(), which calls this function.
PointTable read_point_table(const std::string& path, const std::string& structures_by = {});

/// Assigns the points at the end of the table that have no structure yet to the structure with this name.
/// @throws Error InvalidInput (more structures than a label image can hold)
void name_structure(PointTable& table, const std::string& path, const std::string& name);

/// Normalizes a normal. The result is {0, 0, 0} for invalid directions (NaN, zero length), which scanners write if the
/// normal is unknown.
[[nodiscard]] Vec3 normal_of(const Vec3& given);

/// Appends an ordered line of marks to a table.
void add_line(PointTable& table, const std::vector<Vec3>& points, bool closed, const std::string& name);

/// Samples the ellipse centre + cos(t) u + sin(t) v with points about one voxel apart; all vectors are in voxels.
[[nodiscard]] std::vector<Vec3> ellipse(const Vec3& centre, const Vec3& u, const Vec3& v);

}  // namespace covol::detail
