#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "covol/mark_kinds.h"
#include "covol/points.h"

namespace covol::detail {

/// What a point file says: coordinates in the file's own order and space.
struct PointTable {
    std::vector<Vec3> points;
    std::vector<MarkLine> lines;
    std::vector<MarkKind> kinds;  ///< none, or one for each point
    std::vector<Vec3> normals;    ///< none, or one for each point, by normal_of()
    std::optional<Vec3> sensor;
    PointSpace space = PointSpace::Unstated;
    PointOrder order = PointOrder::Unstated;
    std::string unit;                      ///< of lengths, as normal_unit() has it; empty: not said
    std::vector<std::string> structures;   ///< named by the marks, in the file's order
    std::vector<std::uint32_t> structure;  ///< of each point, one of them; empty where none were asked for
    std::string rule;                      ///< which columns or elements, for people
};

/// Picks the reader by the name's end. @throws as read_points(), which it serves.
/// @param structures_by  as of read_structures_of_points(); empty: nothing
PointTable read_point_table(const std::string& path, const std::string& structures_by = {});

/// The points that belong to no structure yet, the last ones of the table, belong to that of this name.
/// @throws Error InvalidInput (more structures than a label image can hold)
void name_structure(PointTable& table, const std::string& path, const std::string& name);

/// A unit vector; 0 of what is no direction (NaN, zero length), which scanners write where they know none.
[[nodiscard]] Vec3 normal_of(const Vec3& given);

/// Appends an ordered line of marks to a table.
void add_line(PointTable& table, const std::vector<Vec3>& points, bool closed, const std::string& name);

/// centre + cos u + sin v, as points about a voxel apart (all in voxels).
[[nodiscard]] std::vector<Vec3> ellipse(const Vec3& centre, const Vec3& u, const Vec3& v);

}  // namespace covol::detail
