#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/run.h"

namespace covol {

/// How far apart points lie on the surface, and how far off it.
struct CloudScale {
    double spacing = 0;  ///< world units: 1 / sqrt(points per area)
    double noise = 0;    ///< standard deviation along the normal
    double nearest = 0;  ///< median distance to the nearest other point
    /// A point and the eleven nearest: median of how far they reach, and of their standard deviation from a quadric,
    /// which is 0.33 of that where they fill a ball
    double near_reach = 0, near_noise = 0;
};
/// From quadrics through neighbourhoods of a sample of the points: that radius at which they are most of a sheet.
[[nodiscard]] COVOL_API CloudScale measure_cloud_scale(const std::vector<Vec3>& points, const RunContext& run = {});

/// The indicator function of a solid: about 1 inside and 0 outside, smooth over a few cells; nearest node beyond its
/// lattice. Thread-safe.
class Indicator {
public:
    struct Values;
    COVOL_API explicit Indicator(std::unique_ptr<const Values> values);
    COVOL_API ~Indicator();
    struct Sample {
        double inside;
        Vec3 gradient;
        double cell;  ///< of its grid there, world units
    };                ///< 1, and 1 / world unit
    [[nodiscard]] COVOL_API Sample at(const Vec3& world) const;
    [[nodiscard]] COVOL_API double inside(const Vec3& world) const;  ///< at(), faster
    [[nodiscard]] COVOL_API double cell() const;                     ///< of its finest grid, world units
    /// visit(box) for each cell of its lattice, world box, that its level 1/2 passes.
    COVOL_API void crossed(const std::function<void(const WorldBox&)>& visit) const;

private:
    std::unique_ptr<const Values> values_;
};

/// What a cloud without normals tells of inside and outside.
struct Orientation {
    std::vector<Vec3> normals;  ///< unit, outward, of the points as they were given; 0 where nothing tells
    std::vector<double> areas;  ///< of the surface that each point stands for, world units squared, from the density
    std::shared_ptr<const Indicator> indicator;  ///< of these
    std::shared_ptr<const Indicator> screened;   ///< drawn to 1/2 at the points as well; null: not needed
    double turned = 0;    ///< share of the points whose normal the last iteration turned by more than 90 degrees
    double off_half = 0;  ///< mean of the indicator over the points, less 1/2, absolute
    int iterations = 0;
    std::size_t mended = 0;  ///< normals that did not stand on the sheet of points on which they are, on its outer side
    /// points of layers of a scan that lie below others: turned, and the surface need not pass them
    std::size_t layered = 0;
};

/// Normals that agree with the indicator function which they make: from a first guess, which points away from where the
/// points are, chi is solved for and each normal replaced by the direction in which chi falls at its point, on finer
/// and finer lattices (Hou and others, Iterative Poisson surface reconstruction, ACM Trans. Graph. 41(4), 2022; Lin,
/// Shi and Liu, Fast and globally consistent normal orientation based on the winding number normal consistency, ACM
/// Trans. Graph. 43(6), 2024). That alone leaves parts turned as a whole, for example a leg: their surface is where chi
/// is -1/2 instead of 1/2. So a normal is also turned where chi says that its point lies on the wrong side.
/// @param scale  of the points: no lattice is finer
/// @throws Error InvalidInput (fewer than 4 points, points without extent), Cancelled.
[[nodiscard]] COVOL_API Orientation orient(const std::vector<Vec3>& points, const CloudScale& scale,
                                           const RunContext& run = {});

/// What files tell of points beside where they are. Each list is empty or has an entry for each point, 0 where nothing
/// is told.
struct PointHints {
    std::vector<Vec3> normals;    ///< unit
    std::vector<Vec3> to_sensor;  ///< unit: from the point to where it was seen from
    bool is_outward = false;      ///< the normals are known to point outwards, as those of sections
};
/// Those of `from` for the points `to` that are left of them, or were made from them: each has those of the nearest.
[[nodiscard]] COVOL_API PointHints carried(const PointHints& hints, const std::vector<Vec3>& from,
                                           const std::vector<Vec3>& to);

/// What became of hints, which are checked and not trusted.
struct HintsReport {
    std::size_t normals = 0, sensors = 0;  ///< points that have them
    bool used = false;                     ///< they make the orientation
    bool from_sensor = false;  ///< by the side from which each point was seen, for its normals are none or not used
    bool inward = false;       ///< all were turned over, for most pointed inwards
    /// share of those given, turned over, that agree with the indicator of the other half of them
    double foreseen = 0;
    double agree = 0;     ///< and with that of the result: how far off they are
    std::string why_not;  ///< used; else empty
};

/// A cloud that is ready for surface_from_cloud().
struct CloudOrientation {
    std::vector<Vec3> points;  ///< those that lie on a surface
    Orientation orientation;   ///< of them
    CloudScale scale;
    std::size_t stray = 0;     ///< points far from all others that lie on no sheet, left out
    std::size_t enclosed = 0;  ///< points that given normals put within the solid, left out
    bool encloses = true;      ///< else the normals are those of what was seen from outside
    bool has_quadrics = true;  ///< else the surface is that of the screened indicator alone
    bool fills = false;        ///< the points fill a solid: the indicator is their density, half at its border
    HintsReport hints;
};
/// measure_cloud_scale(), without stray points, and orient(); where normals go on turning there, the points hardly
/// enclose anything, as scans of some sides do: then each normal points to where its point can be seen from. Points
/// that fill a solid are known by their neighbourhoods, of which none is a sheet; their density is the indicator.
[[nodiscard]] COVOL_API CloudOrientation orient_cloud(const std::vector<Vec3>& points, const RunContext& run = {});
/// The same, by normals and sensors where they are consistent: half of them has to foresee the sides of the other half,
/// and an orientation that settles without them may not contradict them in whole parts. A sensor gives each point the
/// normal of its local plane on the side that was seen.
/// @throws Error also InvalidInput (a list of another size)
[[nodiscard]] COVOL_API CloudOrientation orient_cloud(const std::vector<Vec3>& points, const PointHints& hints,
                                                      const RunContext& run = {});

}  // namespace covol
