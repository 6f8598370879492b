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
    double step = 0.0;  ///< largest distance between neighbouring points, world units, > 0; the voxel size h
    ContourCurve curve = ContourCurve::Spline;
    double thickness = 0.0;  ///< of a body that is marked on a single slice, world units; 0: not known
};

template <>
inline constexpr auto kOptions<ContourOptions> = std::tuple{
    Option{"step", &ContourOptions::step, kPositive},
    Option{"contour_curve", &ContourOptions::curve, Group::ReadingMarks, "how neighbouring marks are joined"},
    Option{"contour_thickness", &ContourOptions::thickness, kLength, Group::ReadingMarks,
           "thickness of a body whose contours all lie on one slice"}};

/// The body that closed contours on parallel slices enclose: shape-based interpolation.
///
/// On each slice the even-odd rule over all of its closed contours says what is inside (an inner contour makes a hole),
/// and the slice carries the signed distance to its contours within the plane. Between two slices these fields are
/// interpolated (Raya and Udupa, IEEE TMI 9, 1990) by cubics (Herman, Zheng and Bucholtz, IEEE CG&A 12, 1992) that do
/// not overshoot, so a hole or a part that the next slice lacks ends in between. Where two single contours do not
/// overlap at all, they are carried along the line between their centroids. Beyond the first and the last slice the
/// body ends in a dome, a paraboloid over a disc; see compute_cap_height().
class ContourSolid {
public:
    struct Data;
    COVOL_API explicit ContourSolid(std::shared_ptr<const Data> data);

    /// Negative inside; a signed distance within the plane on a slice, of the same order elsewhere (world units).
    [[nodiscard]] COVOL_API double level(const Vec3& world) const;
    /// level() of first, first + step, ..., `count` of them.
    COVOL_API void levels(const Vec3& first, const Vec3& step, int count, float* values) const;
    /// False only where the surface does not meet the ball.
    [[nodiscard]] COVOL_API bool may_meet(const Vec3& center, double radius) const;
    /// Holds the body.
    [[nodiscard]] COVOL_API WorldBox box() const;
    /// Points of the surface between the slices and on the domes, in world units; one for each lattice line of the
    /// slices' grid that crosses the surface along the axis which its normal is closest to.
    [[nodiscard]] COVOL_API std::vector<Vec3> surface_points(double step, const RunContext& run = {}) const;
    /// One position deep inside each hole of each slice.
    [[nodiscard]] COVOL_API std::vector<Vec3> hole_seeds() const;

private:
    std::shared_ptr<const Data> data_;
};

/// The height of the dome beyond the last slice: where a cross-section that goes on to shrink as between the last two
/// slices would vanish (in area, which is linear near the pole of an ellipsoid), but not beyond the next slice that
/// could have been marked. Where the section does not shrink the dome reaches that one: it holds half a slice.
/// @param area, before  of the last slice and of the one before it, 0 when there is none
/// @param distance      between those two
/// @param gap           usual distance between marked slices
[[nodiscard]] COVOL_API double compute_cap_height(double area, double before, double distance, double gap);

/// Sections in planes of several directions, as densify() found them.
struct Sections;

/// Marks on slices, made dense enough to hold a level set.
struct Contours {
    std::vector<Vec3> marks;                    ///< as they were clicked, world units
    std::vector<Vec3> along;                    ///< on the lines through them, the marks included
    std::vector<Vec3> between;                  ///< on the interpolated surface between slices and on the caps: a guess
    std::shared_ptr<const ContourSolid> solid;  ///< null without a closed contour
    std::size_t closed = 0, open = 0;           ///< lines
    std::size_t slices = 0;                     ///< with closed contours; planes of a network
    bool flat = false;  ///< all marks lie on one of several slices, and no thickness was given: the body is a guess
    double slice_distance = 0;  ///< between neighbouring ones of them, the median; world units
    std::string summary;        ///< one line for people
    bool is_network = false;    ///< planes of several directions: no solid, `along` is thinned, and the sides are told
    std::shared_ptr<const Sections> sections;  ///< of a network of closed lines alone, or null
    std::vector<Vec3> inside, outside;         ///< of a network: places in its planes, by the even-odd rule in each
    /// Of a network: of each place of `along` the direction within its plane that points out of the section; empty
    /// where there are open lines.
    std::vector<Vec3> outward;
};

/// Joins and densifies the lines of one or several clouds (several belong to one structure), and closes what lies
/// between the slices.
///
/// The plane of a line is found from its marks: an index coordinate that is constant along it, else the plane that they
/// lie closest to. Closed lines in parallel planes of any direction make the solid, in an image where all lie across
/// axes those of the axis with the most marks; closed lines in other planes are a network. Other lines are
/// joined along themselves only. Points that belong to no line count as marks. A closed line of fewer than three
/// distinct marks is taken as open.
/// @throws Error InvalidOptions; InvalidInput (no line; a line that lies in no plane; a line outside the image: both
///         name it).
[[nodiscard]] COVOL_API Contours densify(const std::vector<PointCloud>& clouds, const ImageGeometry& geometry,
                                         const ContourOptions& options, const RunContext& run = {});
/// Clouds in world units without an image.
[[nodiscard]] COVOL_API Contours densify(const std::vector<PointCloud>& clouds, const ContourOptions& options,
                                         const RunContext& run = {});

}  // namespace covol
