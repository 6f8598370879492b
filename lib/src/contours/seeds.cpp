#include "covol/seeds.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/number.h"
#include "contours/contour_curve.h"
#include "covol/error.h"
#include "points/kd_tree.h"

namespace covol {
namespace {

using detail::to_text;

std::vector<Vec3> seeds_along(const PointCloud& cloud, const std::vector<Vec3>& world, double step) {
    std::vector<Vec3> seeds;
    std::vector<char> in_line(world.size(), 0);
    for (const MarkLine& line : cloud.lines) {
        if (line.begin >= line.end || line.end > world.size()) continue;
        std::fill(in_line.begin() + std::ptrdiff_t(line.begin), in_line.begin() + std::ptrdiff_t(line.end), 1);
        const std::vector<Vec3> marks(world.begin() + std::ptrdiff_t(line.begin),
                                      world.begin() + std::ptrdiff_t(line.end));
        for (const Vec3& p : detail::subdivide(marks, line.closed && marks.size() >= 3, step)) seeds.push_back(p);
    }
    for (std::size_t n = 0; n < world.size(); ++n)
        if (!in_line[n]) seeds.push_back(world[n]);
    return seeds;
}

}  // namespace

std::vector<Vec3> collect_seeds(const PointCloud& cloud, const ImageGeometry& geometry, double step) {
    return seeds_along(cloud, to_world(cloud, geometry), step);
}

std::vector<Vec3> collect_seeds(const PointCloud& cloud, double step) {
    return seeds_along(cloud, to_world(cloud), step);
}

std::string SeedCheck::warning() const {
    if (wrong() == 0) return {};
    const char* const all = painted == 0                 ? "seeds"
                            : painted < inside + outside ? "seeds and painted voxels"
                                                         : "painted voxels";
    const char* const ones = painted == 0 ? "seeds" : "ones";
    std::ostringstream text;
    text << wrong() << " of " << inside + outside << " " << all << " lie on the wrong side of the surface ("
         << wrong_inside << " inside " << ones << " outside, " << wrong_outside << " outside " << ones
         << " inside), the first at " << to_text(first) << "; add marks on the border near them to move it";
    return text.str();
}

SeedCheck check_seeds(const FloatGrid& surface, const std::vector<Vec3>& inside, const std::vector<Vec3>& outside,
                      double slack) {
    SeedCheck check;
    check.inside = inside.size();
    check.outside = outside.size();
    const auto accessor = surface.getConstAccessor();
    const auto look_at = [&](const std::vector<Vec3>& seeds, double sign, std::size_t& wrong) {
        for (const Vec3& seed : seeds) {
            const openvdb::Vec3d at = surface.transform().worldToIndex(openvdb::Vec3d(seed[0], seed[1], seed[2]));
            const double beyond = sign * double(openvdb::tools::BoxSampler::sample(accessor, at));
            if (!(beyond > slack)) continue;
            if (check.wrong() == 0) check.first = seed;
            ++wrong;
            check.farthest = std::max(check.farthest, beyond);
        }
    };
    look_at(inside, 1, check.wrong_inside);
    look_at(outside, -1, check.wrong_outside);
    return check;
}

void check_sides(const std::vector<Vec3>& inside, const std::vector<Vec3>& outside, double same) {
    if (inside.empty() || outside.empty()) return;
    const detail::KdTree tree(inside);
    for (const Vec3& seed : outside)
        if (tree.nearest(seed) <= same * same)
            throw Error(Errc::InvalidInput,
                        "expected each position on one side only, got " + to_text(seed) +
                            " inside and outside; remove it from `inside` or `outside`",
                        "outside");
}

}  // namespace covol
