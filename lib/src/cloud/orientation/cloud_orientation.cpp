// The choice between several orientations of a cloud: computed from the points, from the hints of its file, or from the
// directions in which its points can be seen.
#include <algorithm>
#include <utility>

#include "base/heuristics.h"
#include "cloud/indicator/consistency.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/indicator/indicator.h"
#include "cloud/orientation/attempts.h"
#include "cloud/orientation/filled.h"
#include "cloud/orientation/given_sides.h"
#include "cloud/orientation/heuristics.h"
#include "cloud/orientation/judge.h"
#include "cloud/orientation/propagation.h"
#include "cloud/orientation/stray.h"
#include "cloud/orientation/views.h"
#include "covol/orientation.h"
#include "covol/points.h"

namespace covol {
namespace {

using cloud::doubt;
using cloud::fraction_missed;
using cloud::is_clean;
using cloud::is_settled;
using cloud::miss_reach;

/// Fraction of the area of the indicator's surface that is farther from every point than coarse_cell().
double bare_fraction(const CloudOrientation& cloud) {
    return cloud::bare_fraction(*cloud.orientation.indicator, cloud.points, cloud::coarse_cell(cloud.scale));
}

bool does_enclose(const CloudOrientation& cloud) {
    // Measured for closed shapes and for scans of one side: the doubt is at most 0.013 for the former and 0.026 to 0.19
    // for the latter; the bare fraction is at most 0.04 for the former and at least 0.14 for the latter.
    return doubt(cloud.orientation) < kCommon.negligible || bare_fraction(cloud) < kCommon.minority;
}
/// Recomputes the indicator with smaller cells if its cells are too large for the detail of the normals, or if the
/// orientation is not settled and the surface misses many points.
/// @param first_cell  cell size of the first attempt of orient()
void refine(CloudOrientation& cloud, double first_cell, const RunContext& run) {
    Orientation& o = cloud.orientation;
    const double spacing = cloud.scale.spacing;
    // If the orientation is settled, the cells may be as small as the points allow; otherwise they are those of the
    // first attempt of orient().
    const double first = is_settled(o) ? cloud::finest_cell(cloud.scale, cloud.points.size()) : first_cell;
    const double cell = cloud::indicator_cell(cloud.points, first);
    if (o.indicator->cell() > kCommon.growth * cell) o.indicator = cloud::indicator_of(cloud.points, o, first, run);
    if (!is_settled(o) && is_clean(cloud.scale) &&
        fraction_missed(*o.indicator, cloud.points, kOrientation.passed_reach * spacing) > kCommon.negligible)
        o.indicator = cloud::indicator_of(cloud.points, o, first / kCommon.growth, run);
}

/// For sheets, as in scans of one side or from the air: orients neighbours to the same side, and each connected part to
/// the side from which most of its points are seen. @return whether this is used: the normals are consistent, and the
/// surface misses no more points than the current one
/// @param cell  cell size of the indicator's grid
bool choose_by_propagation(CloudOrientation& cloud, double cell, double reach, const RunContext& run) {
    // If the noise is not small compared to the spacing, nearest neighbours may lie above one another instead of beside
    // one another, and quadrics form handles in regions without points.
    if (!is_clean(cloud.scale)) return false;
    PointHints hints;
    hints.normals = cloud::propagated_normals(cloud.points, cloud.scale, cloud.scale.spacing,
                                              cloud::towards_sky(cloud.points, cloud.scale));
    hints.is_outward = true;
    cloud::GivenSides sheets = cloud::given_sides(cloud.points, hints, cloud.scale, cell, run);
    if (!sheets.report.used || sheets.torn > kCloud.few) return false;
    cloud::add_screened(cloud.points, cloud.scale, {}, nullptr, sheets.orientation, run);
    if (fraction_missed(*sheets.orientation.screened, cloud.points, reach) >
        fraction_missed(*cloud.orientation.indicator, cloud.points, reach))
        return false;
    cloud.orientation = std::move(sheets.orientation);
    return cloud.encloses = true;
}

/// For points that enclose nothing with their current orientation: orients them by views, unless the surface from views
/// misses many more points than the current one, and the current one is not mostly bare or misses few points.
/// @param reach  distance from a point beyond which the surface misses it
void choose_by_views(CloudOrientation& cloud, double reach, const RunContext& run) {
    const double passed = fraction_missed(*cloud.orientation.indicator, cloud.points, reach);
    // Whether more than half of the surface's area closes gaps between the points. The measured bare fraction is up to
    // 0.04 for closed shapes, 0.14 to 0.37 for scans of some sides, and 0.66 to 0.85 for scans from the air.
    const bool mostly_bare = bare_fraction(cloud) > 0.5;
    Orientation seen = cloud::orient_by_views(cloud.points, cloud.scale, run);
    // Normals are unstable in the folds of a closed surface as well, but there the surface from views misses most
    // points. The number of points missed by the current surface, divided by that of the surface from views, was
    // measured as 0.06 to 0.21 for closed shapes and shells open at one end, and 0.83 to 0.97 for scans of one side.
    cloud.encloses = (!mostly_bare || passed < kCommon.negligible) &&
                     kCommon.clear_ratio * passed < fraction_missed(*seen.indicator, cloud.points, reach);
    if (cloud.encloses) return;
    cloud.orientation = std::move(seen);
    cloud.has_quadrics = false;
}

/// Removes points that are inside the solid according to the given normals, since they are not on the surface. @return
/// whether there were any
bool drop_enclosed(CloudOrientation& cloud, PointHints& hints, const cloud::GivenSides& given) {
    const std::vector<char> enclosed = cloud::find_enclosed(cloud.points, given.given, *given.orientation.indicator,
                                                            cloud.scale, miss_reach(cloud.scale));
    cloud.enclosed = std::size_t(std::count(enclosed.begin(), enclosed.end(), 1));
    if (cloud.enclosed == 0) return false;
    std::vector<Vec3> left;
    for (std::size_t n = 0; n < enclosed.size(); ++n)
        if (!enclosed[n]) left.push_back(cloud.points[n]);
    hints = carried(hints, cloud.points, left);
    cloud.points = std::move(left);
    return true;
}

/// Orients the cloud by the hints if they are consistent and a reliable orientation does not contradict them, otherwise
/// by the points alone, and by propagation or views if the points then enclose nothing.
/// @param part  part_side() of the cloud
void choose_orientation(CloudOrientation& cloud, double part, PointHints hints, const RunContext& run) {
    const auto first_cell = [&] { return cloud::first_cell(cloud.scale, part, cloud.points.size()); };
    const auto checked = [&] { return cloud::given_sides(cloud.points, hints, cloud.scale, first_cell(), run); };
    cloud::GivenSides given = checked();
    if (given.report.used && drop_enclosed(cloud, hints, given)) given = checked();
    HintsReport& report = cloud.hints = given.report;
    if (!report.used && cloud::fill_a_solid(cloud.points, cloud.scale.nearest, run)) {
        cloud.orientation = cloud::orient_filled(cloud.points, cloud.scale);
        cloud.fills = true;
        cloud.has_quadrics = false;
        return;
    }
    const bool is_certain = report.used && given.torn < kCloud.few && is_settled(given.orientation);
    if (!is_certain) {
        cloud.orientation = cloud::try_orientations(cloud.points, cloud.scale, part, run);
        cloud.encloses = does_enclose(cloud);
        const double reach = kOrientation.passed_reach * cloud.scale.spacing;
        // Walls inside a solid can be identified only by given normals, and some points of such walls may remain.
        // Therefore given normals are not overruled if they have identified enclosed points.
        if (report.used && cloud.encloses && cloud.enclosed == 0 &&
            1 - cloud::agreeing(cloud.points, given.orientation.normals, cloud.orientation, false) >
                kCommon.negligible &&
            // In narrow folds, the computed normals may be wrong; their surface then misses more points than that of
            // the given normals, which are kept.
            fraction_missed(*cloud.orientation.indicator, cloud.points, reach) <=
                fraction_missed(*given.orientation.indicator, cloud.points, reach)) {
            report.used = false;
            report.why_not = "in whole regions they point to the wrong side";
        }
        if (!report.used && !cloud.encloses && !choose_by_propagation(cloud, first_cell(), reach, run))
            choose_by_views(cloud, reach, run);
        if (!report.used && cloud.encloses && !cloud.orientation.screened) refine(cloud, first_cell(), run);
    }
    if (report.used) {
        cloud.orientation = std::move(given.orientation);
        cloud.encloses = true;
    }
    report.agree = cloud::agreeing(cloud.points, given.given, cloud.orientation, report.inward);
    // Only the sides of given normals are used, not their directions, which may be those of flat faces: such normals do
    // not show where the edges between the faces are, and quadrics fitted to one face would extend beyond its edges.
    if (report.used) cloud::take_directions(*cloud.orientation.indicator, cloud.points, cloud.orientation.normals);
}

}  // namespace

CloudOrientation orient_cloud(const std::vector<Vec3>& points, const RunContext& run) {
    return orient_cloud(points, {}, run);
}

CloudOrientation orient_cloud(const std::vector<Vec3>& points, const PointHints& hints, const RunContext& run) {
    CloudOrientation cloud;
    with_threads(run, [&] {
        cloud.points = merge_close_points(points, 0);
        cloud.scale = measure_cloud_scale(cloud.points, run);
        const double part = cloud::part_side(cloud.points, cloud.scale);
        // If there are many stray points, some can be detected only after others were removed.
        for (int round = 0; round < kCloud.settling; ++round) {
            const std::vector<char> stray = cloud::find_stray(cloud.points, cloud.scale, run);
            std::size_t kept = 0;
            for (std::size_t n = 0; n < stray.size(); ++n)
                if (!stray[n]) cloud.points[kept++] = cloud.points[n];
            const std::size_t gone = stray.size() - kept;
            cloud.stray += gone;
            cloud.points.resize(kept);
            if (double(gone) < kCloud.few * double(stray.size())) break;
        }
        choose_orientation(cloud, part, carried(hints, points, cloud.points), run);
    });
    return cloud;
}

}  // namespace covol
