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
    Spline  ///< by a centripetal Catmull-Rom curve through them (Yuksel, Schaefer, Keyser 2011)
};
template <>
inline constexpr auto kWords<ContourCurve> = std::array{"lines", "spline"};

struct ContourOptions {
    double step = 0.0;  ///< maximum distance between neighbouring points, world units, > 0; the voxel size h
    ContourCurve curve = ContourCurve::Spline;
    double thickness = 0.0;  ///< of a body that is marked on a single slice, world units; 0: unknown
};

template <>
inline constexpr auto kOptions<ContourOptions> = std::tuple{
    Option{"step", &ContourOptions::step, kPositive},
    Option{"contour_curve", &ContourOptions::curve, Group::ReadingMarks, "curve that joins neighbouring marks"},
    Option{"contour_thickness", &ContourOptions::thickness, kLength, Group::ReadingMarks,
           "thickness of a body whose contours all lie on one slice"}};

/// The body that closed contours on parallel slices enclose: shape-based interpolation.
///
/// On each slice the even-odd rule over all of its closed contours determines what is inside (an inner contour makes a
/// hole), and the slice carries the signed distance to its contours within the plane. Between two slices these fields
/// are interpolated (Raya and Udupa, IEEE TMI 9, 1990) by cubics (Herman, Zheng and Bucholtz, IEEE CG&A 12, 1992) that
/// do not overshoot, so that a hole or a part that the next slice lacks ends in between. If two single contours do not
/// overlap at all, they are shifted along the line between their centroids. Beyond the first and the last slice the
/// body ends in a dome, a paraboloid over a disc; see compute_cap_height().
class ContourSolid {
public:
    struct Data;
    COVOL_API explicit ContourSolid(std::shared_ptr<const Data> data);

    /// Negative inside; a signed distance within the plane on a slice, of the same order elsewhere (world units).
    [[nodiscard]] COVOL_API double level(const Vec3& world) const;
    /// level() of first, first + step, ..., `count` of them.
    COVOL_API void levels(const Vec3& first, const Vec3& step, int count, float* values) const;
    /// False only if the surface does not meet the ball.
    [[nodiscard]] COVOL_API bool may_meet(const Vec3& center, double radius) const;
    /// A box that contains the body.
    [[nodiscard]] COVOL_API WorldBox box() const;
    /// Intersections of the surface with the lines of a grid, between the slices and on the domes, in world units. At
    /// each node, only the grid axis closest to the surface's normal is used.
    /// @param step  maximum distance between the grid's layers along the normal of the slices
    [[nodiscard]] COVOL_API std::vector<Vec3> surface_points(double step, const RunContext& run = {}) const;
    /// One position deep inside each hole of each slice.
    [[nodiscard]] COVOL_API std::vector<Vec3> hole_seeds() const;

private:
    std::shared_ptr<const Data> data_;
};

/// The height of the dome beyond the last slice: the distance at which the cross-section would vanish if it continued
/// to shrink as between the last two slices (in area, which is linear near the pole of an ellipsoid), limited by the
/// next slice that could have been marked. If the section does not shrink, the dome reaches that slice; a paraboloid
/// then has half of the volume up to it.
/// @param area, before  of the last slice and of the one before it, 0 when there is none
/// @param distance      between those two
/// @param gap           usual distance between marked slices
[[nodiscard]] COVOL_API double compute_cap_height(double area, double before, double distance, double gap);

/// Sections in planes of several directions, as densify() found them.
struct Sections;

/// Marks on slices, densified enough to determine a level set.
struct Contours {
    std::vector<Vec3> marks;    ///< as they were set, world units
    std::vector<Vec3> along;    ///< on the lines through them, the marks included
    std::vector<Vec3> between;  ///< on the interpolated surface between slices and on the caps: part of the guess
    std::shared_ptr<const ContourSolid> solid;  ///< null without a closed contour
    std::size_t closed = 0, open = 0;           ///< numbers of lines
    std::size_t slices = 0;                     ///< with closed contours; for a network, planes
    bool flat = false;  ///< all marks lie on one of several slices, and no thickness was given: the extent across it is
                        ///< an estimate
    double slice_distance = 0;                 ///< median distance between neighbouring marked slices, world units
    std::string summary;                       ///< one line for the user
    bool is_network = false;                   ///< planes of several directions: no solid, thinned `along`, known sides
    std::shared_ptr<const Sections> sections;  ///< of a network of closed lines only, else null
    std::vector<Vec3> inside, outside;         ///< of a network: positions in its planes, by the even-odd rule in each
    /// Of a network: for each point of `along`, the direction within its plane that points out of the section; empty if
    /// there are open lines.
    std::vector<Vec3> outward;
};

/// Joins and densifies the lines of one or several clouds, which belong to one structure, and interpolates the surface
/// between the slices.
///
/// The plane of a line is determined from its marks: an index coordinate that is constant along it, else the plane
/// closest to them. Closed lines in parallel planes of any direction form the solid; if all planes of an image's lines
/// are perpendicular to its axes, those of the axis with the most marks do. Closed lines in other planes form a
/// network. All other lines are densified along themselves only. Points that belong to no line count as marks. A closed
/// line of fewer than three distinct marks is treated as open.
/// @throws Error InvalidOptions; InvalidInput (no line; a line that lies in no plane; a line outside the image: both
///     messages name the line).
[[nodiscard]] COVOL_API Contours densify(const std::vector<PointCloud>& clouds, const ImageGeometry& geometry,
                                         const ContourOptions& options, const RunContext& run = {});
/// For clouds in world units without an image.
[[nodiscard]] COVOL_API Contours densify(const std::vector<PointCloud>& clouds, const ContourOptions& options,
                                         const RunContext& run = {});

}  // namespace covol
