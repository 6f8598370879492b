#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/run.h"

namespace covol {

/// Typical distances between the points of a cloud, and between the points and the surface.
struct CloudScale {
    double spacing = 0;  ///< world units: 1 / sqrt(points per area)
    double noise = 0;    ///< standard deviation of the points from the surface, along its normal
    double nearest = 0;  ///< median distance to the nearest other point
    /// for groups of a point and its eleven nearest neighbours: the median radius of the groups, and the median of the
    /// standard deviation of a group's points from a quadric fitted to them. The second is 0.33 of the first if the
    /// points fill a ball.
    double near_reach = 0, near_noise = 0;
};
/// Measures the scale of a cloud. Quadrics are fitted to neighbourhoods of a sample of the points with increasing
/// radii; spacing and noise are those at the radius for which the points' deviation from the quadrics, divided by the
/// radius, is smallest.
[[nodiscard]] COVOL_API CloudScale measure_cloud_scale(const std::vector<Vec3>& points, const RunContext& run = {});

/// The indicator function of a solid, stored on a lattice: about 1 inside and 0 outside, with a smooth transition over
/// a few cells of the lattice. Beyond the lattice it has the value of the nearest node. Thread-safe.
class Indicator {
public:
    struct Values;
    COVOL_API explicit Indicator(std::unique_ptr<const Values> values);
    COVOL_API ~Indicator();
    struct Sample {
        double inside;  ///< value of the indicator
        Vec3 gradient;  ///< of that value, per world unit
        double cell;    ///< cell size of the indicator's grid at this position, world units
    };
    [[nodiscard]] COVOL_API Sample at(const Vec3& world) const;
    [[nodiscard]] COVOL_API double inside(const Vec3& world) const;  ///< the same as at(world).inside, but faster
    [[nodiscard]] COVOL_API double cell() const;  ///< cell size of the indicator's finest grid, world units
    /// Calls visit(box), with the box in world units, for each cell that the indicator's level 1/2 crosses.
    COVOL_API void crossed(const std::function<void(const WorldBox&)>& visit) const;

private:
    std::unique_ptr<const Values> values_;
};

/// The result of orienting a cloud.
struct Orientation {
    std::vector<Vec3> normals;  ///< outward unit normals, one for each point; 0 if unknown
    std::vector<double> areas;  ///< area of the surface that each point represents, from the density, world units^2
    std::shared_ptr<const Indicator> indicator;  ///< from these normals and areas
    /// the screened indicator, which is also fitted to 1/2 at the points; null unless the points form sheets that
    /// enclose nothing, or fill a solid
    std::shared_ptr<const Indicator> screened;
    /// fraction of the points whose normal was turned by more than 90 degrees in the last iteration
    double turned = 0;
    double off_half = 0;  ///< absolute difference between 1/2 and the indicator's mean over the points; 0 is ideal
    int iterations = 0;
    /// number of normals that were replaced, because they differed by more than 60 degrees from the normals of the
    /// sheet that the neighbouring points form, or pointed to the wrong side of it
    std::size_t mended = 0;
    /// number of points in layers of a scan that lie below other layers: their normals were turned, and the surface
    /// need not pass through them
    std::size_t layered = 0;
};

/// Computes normals that are consistent with the indicator function chi that they define. Starting from normals that
/// point away from the points, two steps are repeated on increasingly fine lattices: chi is computed from the normals,
/// and each normal is replaced by the direction in which chi decreases at its point (Hou and others, Iterative Poisson
/// surface reconstruction, ACM Trans. Graph. 41(4), 2022; Lin, Shi and Liu, Fast and globally consistent normal
/// orientation based on the winding number normal consistency, ACM Trans. Graph. 43(6), 2024). This alone may leave
/// whole parts inverted, for example a leg, whose surface then lies at chi = -1/2 instead of 1/2. Therefore a normal is
/// also flipped if chi indicates that its point lies on the wrong side.
/// @param scale  of the points; determines the finest lattice
/// @throws Error InvalidInput (fewer than 4 points, points without extent), Cancelled.
[[nodiscard]] COVOL_API Orientation orient(const std::vector<Vec3>& points, const CloudScale& scale,
                                           const RunContext& run = {});

/// Information from files about points in addition to their positions. Each list is empty or has an entry for each
/// point, which is 0 if it is unknown.
struct PointHints {
    std::vector<Vec3> normals;    ///< unit vectors; any of them may point inwards instead of outwards
    std::vector<Vec3> to_sensor;  ///< unit vectors from the points to the positions from which they were seen
    bool is_outward = false;      ///< the normals are known to point outwards, like those of a network's sections
};
/// Transfers the hints of the points `from` to the points `to`, which are a subset of `from` or were made from them:
/// each point gets the hints of the nearest point of `from`.
[[nodiscard]] COVOL_API PointHints carried(const PointHints& hints, const std::vector<Vec3>& from,
                                           const std::vector<Vec3>& to);

/// Whether and how hints were used. They are used only if they are consistent with the points.
struct HintsReport {
    /// number of points with a given normal, and with a given direction to the sensor
    std::size_t normals = 0, sensors = 0;
    bool used = false;  ///< the hints determine the orientation
    /// the orientation follows from the sides from which points were seen, because there are no usable normals
    bool from_sensor = false;
    bool inward = false;  ///< all given normals were flipped, because most pointed inwards
    /// cross-validation: fraction of the given normals, after flipping, that agree with an indicator computed from the
    /// other half of them
    double predicted = 0;
    double agree = 0;     ///< fraction of the given normals that agree with the resulting indicator
    std::string why_not;  ///< why the hints are not used; empty if they are used
};

/// A cloud that is ready for surface_from_cloud().
struct CloudOrientation {
    std::vector<Vec3> points;  ///< the points that lie on the surface
    Orientation orientation;   ///< of these points
    CloudScale scale;
    std::size_t stray = 0;     ///< number of removed points that are far from all others and lie on no sheet
    std::size_t enclosed = 0;  ///< number of removed points that lie inside the solid according to the given normals
    bool encloses = true;      ///< false: the points enclose nothing, and each normal points to the side from which its
                               ///< point can be seen
    bool has_quadrics = true;  ///< false: the surface is that of the screened indicator alone
    /// the points fill a solid: the indicator is their density, which is 1/2 at the solid's border
    bool fills = false;
    HintsReport hints;
};
/// Calls measure_cloud_scale(), removes stray points, and calls orient(). If normals keep flipping in orient(), the
/// points hardly enclose anything, as in scans of a few sides: then the sides of normals are propagated between
/// neighbours or, if neighbours do not agree, each normal points to the side from which its point can be seen. If the
/// points fill a solid, so that no neighbourhood is a sheet, the indicator is their density.
[[nodiscard]] COVOL_API CloudOrientation orient_cloud(const std::vector<Vec3>& points, const RunContext& run = {});
/// Orients a cloud with hints if they are consistent, else without them. At least half of the points must have hints,
/// and one half of the hints has to predict the sides of the other half. If neighbouring normals still contradict each
/// other, or normals contradict their indicator, the cloud is also oriented without hints. Hints that contradict this
/// orientation in whole regions are not used if it encloses a solid, if its surface misses no more points than theirs,
/// and if they have identified no points inside the solid.
/// A sensor direction gives a point the normal of its local plane, on the side that was seen.
/// @throws Error also InvalidInput (a list of hints that is neither empty nor as long as `points`)
[[nodiscard]] COVOL_API CloudOrientation orient_cloud(const std::vector<Vec3>& points, const PointHints& hints,
                                                      const RunContext& run = {});

}  // namespace covol
