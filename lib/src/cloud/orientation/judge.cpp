#include "cloud/orientation/judge.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "base/heuristics.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/indicator/indicator.h"
#include "cloud/orientation/heuristics.h"
#include "covol/points.h"
#include "points/parts.h"

namespace covol::cloud {

double finest_cell(const CloudScale& scale, std::size_t points) {
    const double sampled = scale.spacing * std::sqrt(std::max(1.0, double(points) / kOrientation.max_sampled));
    return std::max(kOrientation.cell_spacings * sampled, scale.noise);
}

double part_side(const std::vector<Vec3>& points, const CloudScale& scale) {
    if (points.empty() || !(scale.spacing > 0)) return 0;
    return largest_part_side(points, kOrientation.first_along, kCloud.coarse * scale.spacing);
}

double first_cell(const CloudScale& scale, double part, std::size_t points) {
    return std::max(finest_cell(scale, points), indicator_side(part) / kOrientation.first_along);
}

bool is_clean(const CloudScale& scale) { return scale.noise < kCloud.flat * scale.spacing; }

double apart(const CloudScale& scale) { return std::max(scale.spacing, scale.noise); }
double coarse_cell(const CloudScale& scale) { return kCloud.coarse * apart(scale); }
double miss_reach(const CloudScale& scale) { return kOrientation.passed_reach * apart(scale); }

double doubt(const Orientation& o) { return o.turned + std::max(0.0, o.off_half - kCommon.negligible); }
bool is_settled(const Orientation& o) { return doubt(o) < kCloud.few; }

double fraction_missed(const Indicator& indicator, const std::vector<Vec3>& points, double reach) {
    std::vector<char> passed(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        const Indicator::Sample at = indicator.at(points[n]);
        const double slope = std::hypot(at.gradient[0], at.gradient[1], at.gradient[2]);
        passed[n] = std::abs(at.inside - 0.5) > reach * slope;
    });
    return double(std::count(passed.begin(), passed.end(), 1)) / double(points.size());
}

}  // namespace covol::cloud
