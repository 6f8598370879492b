#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/run.h"

namespace covol {

/// The distance between points on the surface, and their distance from it.
struct CloudScale {
    double spacing = 0;  ///< world units: 1 / sqrt(points per area)
    double noise = 0;    ///< standard deviation along the normal
    double nearest = 0;  ///< median distance to the nearest other point
    /// For a point and its eleven nearest neighbours: median of their radius, and of their standard deviation from a
    /// quadric, which is 0.33 of the radius if they fill a ball
    double near_reach = 0, near_noise = 0;
};
/// From quadrics through neighbourhoods of a sample of the points, at the radius at which they are most like a sheet.
[[nodiscard]] COVOL_API CloudScale measure_cloud_scale(const std::vector<Vec3>& points, const RunContext& run = {});

/// The indicator function of a solid: about 1 inside and 0 outside, smooth over a few cells; beyond its lattice the
/// value of the nearest node. Thread-safe.
class Indicator {
public:
    struct Values;
    COVOL_API explicit Indicator(std::unique_ptr<const Values> values);
    COVOL_API ~Indicator();
    struct Sample {
        double inside;
        Vec3 gradient;
        double cell;  ///< of its grid at this position, world units
    };                ///< units: 1, 1 / world unit, world units
    [[nodiscard]] COVOL_API Sample at(const Vec3& world) const;
    [[nodiscard]] COVOL_API double inside(const Vec3& world) const;  ///< as at(), but faster
    [[nodiscard]] COVOL_API double cell() const;                     ///< of its finest grid, world units
    /// Calls visit(box), with a world box, for each cell of its lattice that its level 1/2 crosses.
    COVOL_API void crossed(const std::function<void(const WorldBox&)>& visit) const;

private:
    std::unique_ptr<const Values> values_;
};

/// What is known about inside and outside from a cloud without normals.
struct Orientation {
    std::vector<Vec3> normals;  ///< unit, outward, of the points as they were given; 0 where unknown
    std::vector<double> areas;  ///< of the surface that each point represents, world units squared, from the density
    std::shared_ptr<const Indicator> indicator;  ///< from these normals and areas
    std::shared_ptr<const Indicator> screened;   ///< also fitted to 1/2 at the points; null: not needed
    /// fraction of the points whose normal was turned by more than 90 degrees in the last iteration
    double turned = 0;
    double off_half = 0;  ///< absolute difference between the mean of the indicator over the points and 1/2
    int iterations = 0;
    /// normals replaced because they were not perpendicular to their sheet of points, or on its wrong side
    std::size_t mended = 0;
    /// points of a scan's layers that lie below others: turned, and the surface need not pass through them
    std::size_t layered = 0;
};

/// Normals that are consistent with the indicator function that they define: from initial normals, which point away
/// from the points, chi is solved for and each normal replaced by the direction in which chi decreases at its point, on
/// finer and finer lattices (Hou and others, Iterative Poisson surface reconstruction, ACM Trans. Graph. 41(4), 2022;
/// Lin, Shi and Liu, Fast and globally consistent normal orientation based on the winding number normal consistency,
/// ACM Trans. Graph. 43(6), 2024). That alone leaves some parts inverted as a whole, for example a leg: their surface
/// is where chi is -1/2 instead of 1/2. Therefore a normal is also flipped if chi indicates that its point lies on the
/// wrong side.
/// @param scale  of the points: determines the finest lattice
/// @throws Error InvalidInput (fewer than 4 points, points without extent), Cancelled.
[[nodiscard]] COVOL_API Orientation orient(const std::vector<Vec3>& points, const CloudScale& scale,
                                           const RunContext& run = {});

/// What files contain about points in addition to their positions. Each list is empty or has an entry for each point, 0
/// if it is unknown.
struct PointHints {
    std::vector<Vec3> normals;    ///< unit
    std::vector<Vec3> to_sensor;  ///< unit: from the point to the position from which it was seen
    bool is_outward = false;      ///< the normals are known to point outwards, as those of sections do
};
/// The hints of `from` for the points `to`, which remain of them or were made from them: each gets those of the
/// nearest.
[[nodiscard]] COVOL_API PointHints carried(const PointHints& hints, const std::vector<Vec3>& from,
                                           const std::vector<Vec3>& to);

/// What was done with the hints, which are checked and not trusted.
struct HintsReport {
    std::size_t normals = 0, sensors = 0;  ///< number of points that have them
    bool used = false;                     ///< they determine the orientation
    /// by the side from which each point was seen, because there are no normals or they are not used
    bool from_sensor = false;
    bool inward = false;  ///< all were flipped, because most pointed inwards
    /// fraction of the given ones, after flipping, that agree with the indicator of the other half of them
    double predicted = 0;
    double agree = 0;     ///< the same with the indicator of the result: measures their errors
    std::string why_not;  ///< why they are not used; empty if they are
};

/// A cloud that is ready for surface_from_cloud().
struct CloudOrientation {
    std::vector<Vec3> points;  ///< those that lie on a surface
    Orientation orientation;   ///< of these points
    CloudScale scale;
    std::size_t stray = 0;     ///< points far from all others that lie on no sheet, removed
    std::size_t enclosed = 0;  ///< points that the given normals place within the solid, removed
    bool encloses = true;      ///< false: the normals point to where each point was seen from outside
    bool has_quadrics = true;  ///< false: the surface is that of the screened indicator alone
    bool fills = false;        ///< the points fill a solid: the indicator is their density, 1/2 at its border
    HintsReport hints;
};
/// measure_cloud_scale(), removal of stray points, and orient(). If normals keep flipping there, the points hardly
/// enclose anything, as in scans of a few sides: each normal then points to where its point can be seen from. Points
/// that fill a solid are recognised by their neighbourhoods, none of which is a sheet; the indicator is then their
/// density.
[[nodiscard]] COVOL_API CloudOrientation orient_cloud(const std::vector<Vec3>& points, const RunContext& run = {});
/// The same, from normals and sensors if they are consistent: half of them has to predict the sides of the other half,
/// and if the orientation without them converges, they must not contradict it in whole parts. A sensor gives each point
/// the normal of its local plane on the side that was seen.
/// @throws Error also InvalidInput (a list of another size)
[[nodiscard]] COVOL_API CloudOrientation orient_cloud(const std::vector<Vec3>& points, const PointHints& hints,
                                                      const RunContext& run = {});

}  // namespace covol
