#pragma once
#include <vector>

#include "contours/slice_field.h"
#include "covol/fwd.h"

namespace covol::detail {

/// A plane of any direction, with orthogonal coordinates in it.
struct SectionPlane {
    Vec3 origin{0, 0, 0}, u{1, 0, 0}, v{0, 1, 0}, normal{0, 0, 1};  ///< u, v, normal: unit vectors, right-handed

    [[nodiscard]] double height(const Vec3& p) const;  ///< signed distance from the plane
    [[nodiscard]] Vec2 flat(const Vec3& p) const;
    [[nodiscard]] Vec3 world(const Vec2& p) const;
};

/// The plane of minimum squared distance to the points. @pre three or more
[[nodiscard]] SectionPlane plane_through(const std::vector<Vec3>& points);

/// The extent of the points along a direction.
[[nodiscard]] double thickness_along(const std::vector<Vec3>& points, const Vec3& direction);

/// The longest side of the points' bounding box.
[[nodiscard]] double extent_of(const std::vector<Vec3>& points);

/// The closed contours of one plane.
struct Section {
    SectionPlane plane;
    std::vector<Polygon> polygons;
};

/// The signed distance within a section's plane to its polygons, negative inside by the even-odd rule.
struct SectionLevels {
    SectionPlane plane;
    SliceGrid grid;
    std::vector<float> level;
    [[nodiscard]] double at(const Vec2& p) const { return sample_slice(level, grid, place_in(grid, p[0], p[1])); }
};
/// @param cell  cell size of the grid, which contains the polygons and a margin; increased if there would be too many
/// nodes
[[nodiscard]] SectionLevels levels_of(const Section& section, double cell);

/// Contours by plane: those within `tolerance` of a common plane form one section.
[[nodiscard]] std::vector<Section> sections_of(const std::vector<std::vector<Vec3>>& contours, double tolerance);

/// Positions along contours, and the unit direction within its plane that points out of the section there.
struct SectionMarks {
    std::vector<Vec3> places, outward;
};
[[nodiscard]] SectionMarks marks_along(const std::vector<Section>& sections, double step);

/// Positions whose side follows from the sections by the even-odd rule.
struct Sides {
    std::vector<Vec3> inside, outside;
};
/// The centres of discs in the planes that intersect no contour, the largest first, none within another: few positions
/// that represent the parts and holes of a section.
/// @param cell  cell size of the grid that is searched, and minimum radius of a disc
[[nodiscard]] Sides sides_of(const std::vector<Section>& sections, double cell);

}  // namespace covol::detail

namespace covol {

struct Sections {
    std::vector<detail::Section> planes;
};

}  // namespace covol
