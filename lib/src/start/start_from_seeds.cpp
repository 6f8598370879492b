// The start from seeds alone: halfway between those inside and those outside.
#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/heuristics.h"
#include "base/median.h"
#include "covol/error.h"
#include "covol/start.h"
#include "points/kd_tree.h"

namespace covol {
namespace {

using Leaf = FloatGrid::TreeType::LeafNodeType;

/// The radius at which balls around the seeds join: half of the longest edge of the seeds' minimum spanning tree
/// (Prim's algorithm). For many seeds, which are dense paint, half of the longest distance of a seed from the nearest
/// other one; separate patches of paint may then remain separate.
double joining_radius(const std::vector<Vec3>& seeds) {
    if (seeds.size() > kCommon.sample) {
        double widest = 0;
        const detail::KdTree tree(seeds);
        for (const Vec3& seed : seeds) widest = std::max(widest, tree.nearest_other(seed));
        return std::sqrt(widest) / 2;
    }
    std::vector<double> nearest(seeds.size(), std::numeric_limits<double>::max());
    std::vector<char> joined(seeds.size(), 0);
    double longest = 0;
    std::size_t last = 0;
    for (std::size_t n = 1; n < seeds.size(); ++n) {
        joined[last] = 1;
        std::size_t next = last;
        for (std::size_t m = 0; m < seeds.size(); ++m) {
            if (joined[m]) continue;
            nearest[m] = std::min(nearest[m], detail::squared_distance(seeds[m], seeds[last]));
            if (joined[next] || nearest[m] < nearest[next]) next = m;
        }
        longest = std::max(longest, nearest[next]);
        last = next;
    }
    return std::sqrt(longest) / 2;
}

/// Half of the median distance from a seed outside to the nearest one inside; `otherwise` without seeds outside.
double usual_half_gap(const std::vector<Vec3>& outside, const detail::KdTree& inside, double otherwise) {
    if (outside.empty()) return otherwise;
    std::vector<double> gaps;
    for (const Vec3& seed : outside) gaps.push_back(inside.nearest(seed));
    return std::sqrt(cloud::median(std::move(gaps))) / 2;
}

}  // namespace

FloatGridPtr start_from_seeds(const Domain& domain, const std::vector<Vec3>& inside, const std::vector<Vec3>& outside,
                              const RunContext& run) {
    if (inside.empty()) throw Error(Errc::InvalidInput, "expected seeds inside, got none");
    if (std::none_of(inside.begin(), inside.end(), [&](const Vec3& seed) { return domain.contains(seed); }))
        throw Error(Errc::InvalidInput,
                    "inside: expected at least one seed in the domain, got none of " + std::to_string(inside.size()) +
                        "; check their coordinates and `roi`",
                    "inside");
    const double h = domain.voxel_size;
    FloatGridPtr field;
    with_threads(run, [&] {
        const detail::KdTree in(inside), out(outside);
        // A voxel and a half is the smallest radius that voxels can represent.
        const double reach =
            std::max({usual_half_gap(outside, in, kHalfWidthVoxels * h), joining_radius(inside) + h, 1.5 * h});
        field = make_grid(domain, float(kHalfWidthVoxels * h), "seeds");
        const WorldBox box = bounding_box(inside, reach + 2 * h);
        const Vec3 low = domain.world_to_index(box.min), high = domain.world_to_index(box.max);
        openvdb::Coord first, last;
        for (int a = 0; a < 3; ++a) {
            first[a] = int(std::floor(std::max(low[a], double(domain.min[a])))) & ~7;
            last[a] = int(std::ceil(std::min(high[a], double(domain.max[a]))));
        }
        std::vector<Leaf*> leaves;
        for (int i = first.x(); i <= last.x(); i += 8)
            for (int j = first.y(); j <= last.y(); j += 8)
                for (int k = first.z(); k <= last.z(); k += 8) leaves.push_back(field->tree().touchLeaf({i, j, k}));
        run.check();
        tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
            for (openvdb::Index at = 0; at < Leaf::SIZE; ++at) {
                const openvdb::Coord c = leaves[n]->offsetToGlobalCoord(at);
                const Vec3 p = domain.index_to_world({double(c.x()), double(c.y()), double(c.z())});
                const double here = std::sqrt(in.nearest(p));
                const double halfway = outside.empty() ? here - reach : (here - std::sqrt(out.nearest(p))) / 2;
                leaves[n]->setValueOn(at, float(std::max(halfway, here - reach)));
            }
        });
    });
    run.check();
    return start_from_grid(domain, *field, run);
}

}  // namespace covol
