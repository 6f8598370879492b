#pragma once
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/image.h"
#include "covol/options_table.h"
#include "covol/points.h"
#include "covol/run.h"

namespace covol {

enum class ContourCurve {
    Lines,  ///< neighbouring marks are joined by straight lines
    Spline  ///< neighbouring marks are joined by a centripetal Catmull-Rom curve (Yuksel, Schaefer, Keyser 2011)
};
template <>
inline constexpr auto kWords<ContourCurve> = std::array{"lines", "spline"};

struct ContourOptions {
    /// maximum distance between neighbouring points on a line, world units, > 0; usually the voxel size h
    double step = 0.0;
    ContourCurve curve = ContourCurve::Spline;
    double thickness = 0.0;  ///< thickness of a body that is marked on a single slice, world units; 0: unknown
};

template <>
inline constexpr auto kOptions<ContourOptions> = std::tuple{
    Option{"step", &ContourOptions::step, kPositive},
    Option{"contour_curve", &ContourOptions::curve, Group::ReadingMarks, "curve that joins neighbouring marks"},
    Option{"contour_thickness", &ContourOptions::thickness, kLength, Group::ReadingMarks,
           "thickness of a body whose contours all lie on one slice"}};

/// The body that closed contours on parallel slices enclose, by shape-based interpolation.
///
/// On each slice the even-odd rule over all of its closed contours determines what is inside (an inner contour makes a
/// hole), and the slice carries the signed distance to its contours within the plane. Between two slices these fields
/// are interpolated (Raya and Udupa, IEEE TMI 9, 1990) by cubics (Herman, Zheng and Bucholtz, IEEE CG&A 12, 1992) that
/// do not overshoot, so that a hole or a part that is missing on the next slice ends between the two slices. If two
/// neighbouring slices have one contour each and these do not overlap, the section is shifted along the line between
/// their centroids. Beyond the first and the last slice the body ends in a dome, a paraboloid over a disc; see
/// compute_cap_height().
class ContourSolid {
public:
    struct Data;
    COVOL_API explicit ContourSolid(std::shared_ptr<const Data> data);

    /// The level function, negative inside: on a slice the signed distance within its plane, elsewhere a value of the
    /// same order of magnitude (world units).
    [[nodiscard]] COVOL_API double level(const Vec3& world) const;
    /// Computes level() at the `count` positions first, first + step, first + 2 step, ...
    COVOL_API void levels(const Vec3& first, const Vec3& step, int count, float* values) const;
    /// Whether the surface may intersect the ball; if false, it certainly does not.
    [[nodiscard]] COVOL_API bool may_meet(const Vec3& center, double radius) const;
    /// A box that contains the body.
    [[nodiscard]] COVOL_API WorldBox box() const;
    /// Points on the surface between the slices and on the domes, world units: intersections with the lines of a grid.
    /// At each node, only the line along the grid axis that is closest to the surface's normal is used.
    /// @param step  maximum distance between the grid's layers along the normal of the slices
    [[nodiscard]] COVOL_API std::vector<Vec3> surface_points(double step, const RunContext& run = {}) const;
    /// For each hole of each slice, the position in the hole that is farthest from the contours; these positions are
    /// outside of the body.
    [[nodiscard]] COVOL_API std::vector<Vec3> hole_seeds() const;

private:
    std::shared_ptr<const Data> data_;
};

/// The height of the dome beyond the last slice: the distance at which the cross-section would vanish if it continued
/// to shrink as between the last two slices (in area, which is linear near the pole of an ellipsoid), but at most
/// `gap`. If the section does not shrink, the height is `gap`; a paraboloid of that height has half of the volume that
/// the section would have if it continued unchanged over `gap`.
/// @param area, before  areas of the last slice's section and of the section before it, 0 if there is none
/// @param distance      between these two slices
/// @param gap           usual distance between marked slices
[[nodiscard]] COVOL_API double compute_cap_height(double area, double before, double distance, double gap);

/// The closed lines of a network, that is, of planes of several directions, as sections in their planes.
struct Sections;

/// Marks on slices, with additional points between them, dense enough to determine a level set.
struct Contours {
    std::vector<Vec3> marks;  ///< as they were set, world units
    /// points on the lines through the marks, including the marks, at most ContourOptions::step apart; for a network,
    /// points at equal distances instead, at most about 1,500 in total
    std::vector<Vec3> along;
    std::vector<Vec3> between;                  ///< points on the interpolated surface between slices and on the domes
    std::shared_ptr<const ContourSolid> solid;  ///< null if there is no closed contour on parallel slices
    std::size_t closed = 0, open = 0;           ///< numbers of closed and open lines
    std::size_t slices = 0;  ///< number of slices with closed contours; for a network, number of planes
    /// All marks lie in one plane and no thickness is given, so that the thickness of the body is an estimate; false if
    /// the image consists of that slice only.
    bool flat = false;
    /// median distance between neighbouring marked slices, world units; for a single slice, the image's spacing (1
    /// without an image); 0 without `solid`
    double slice_distance = 0;
    std::string summary;      ///< one line for the user
    bool is_network = false;  ///< the planes have several directions: `solid` is null, and the sides of positions are
                              ///< in `inside` and `outside`
    /// the closed lines of a network; null if there is no network, or if it has open lines or single points
    std::shared_ptr<const Sections> sections;
    /// for a network: positions in its planes, determined by the even-odd rule in each plane
    std::vector<Vec3> inside, outside;
    /// For a network: for each point of `along`, the direction within its plane that points out of the section; empty
    /// if there are open lines.
    std::vector<Vec3> outward;
};

/// Adds points between the marks on the lines of one or several clouds, which belong to one structure, and interpolates
/// the surface between the slices.
///
/// The plane of a line is determined from its marks: if an index coordinate is constant along the line, the plane of
/// that slice, else the plane closest to the marks. Closed lines in parallel planes of any direction form the solid; if
/// all planes of an image's lines are perpendicular to its axes, only the lines perpendicular to the axis with the most
/// marks form it. Closed lines in other planes form a network. From all other lines, only points along the lines are
/// generated. Points that belong to no line count as marks. A closed line of fewer than three distinct marks is treated
/// as open.
/// @throws Error InvalidOptions; InvalidInput (no line; a line that lies in no plane; a line outside the image: both
///     messages name the line).
[[nodiscard]] COVOL_API Contours densify(const std::vector<PointCloud>& clouds, const ImageGeometry& geometry,
                                         const ContourOptions& options, const RunContext& run = {});
/// Adds points between the marks on lines and interpolates the surface, as the overload with an image does; for clouds
/// in world units.
[[nodiscard]] COVOL_API Contours densify(const std::vector<PointCloud>& clouds, const ContourOptions& options,
                                         const RunContext& run = {});

}  // namespace covol
