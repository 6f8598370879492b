#include "bricks/split.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>

namespace covol::bricks {
namespace {

constexpr int kLeaf = 8;

/// The index, divided by 8, of the leaf of the fine lattice that contains a voxel of the coarse band.
using Place = std::array<std::int32_t, 3>;

std::vector<Place> places_of(const Domain& domain, const FloatGrid& coarse) {
    std::vector<Place> places;
    for (auto value = coarse.cbeginValueOn(); value; ++value) {
        const openvdb::Vec3d w = coarse.indexToWorld(value.getCoord());
        const Vec3 at = domain.world_to_index({w[0], w[1], w[2]});
        Place place;
        for (int a = 0; a < 3; ++a) {
            const double inside = std::clamp(std::round(at[a]), double(domain.min[a]), double(domain.max[a]));
            place[a] = std::int32_t(inside) >> 3;
        }
        places.push_back(place);
    }
    return places;
}

class Splitter {
public:
    /// @param weight  number of voxels of the fine band that one place represents
    Splitter(const Domain& domain, double weight, const BrickOptions& options)
        : domain_(domain), weight_(weight), maximum_(double(options.max_voxels)) {}

    void split(VoxelBox box, std::vector<Place>::iterator begin, std::vector<Place>::iterator end) {
        const double voxels = weight_ * double(end - begin);
        if (voxels > maximum_)
            for (const int axis : longest_first(begin, end)) {
                std::nth_element(begin, begin + (end - begin) / 2, end,
                                 [axis](const Place& p, const Place& q) { return p[axis] < q[axis]; });
                // Index of the first leaf of the upper part along the axis.
                const std::int32_t first = (begin + (end - begin) / 2)->at(axis);
                const auto upper = std::partition(begin, end, [&](const Place& p) { return p[axis] < first; });
                if (upper == begin || upper == end) continue;
                VoxelBox lower_box = box, upper_box = box;
                lower_box.max[axis] = first * kLeaf - 1;
                upper_box.min[axis] = first * kLeaf;
                split(lower_box, begin, upper);
                split(upper_box, upper, end);
                return;
            }
        bricks_.push_back({box, std::llround(voxels), {}});
    }

    [[nodiscard]] std::vector<Brick> bricks() && { return std::move(bricks_); }

private:
    static std::array<int, 3> longest_first(std::vector<Place>::const_iterator begin,
                                            std::vector<Place>::const_iterator end) {
        Place low = *begin, high = *begin;
        for (auto p = begin; p != end; ++p)
            for (int a = 0; a < 3; ++a) {
                low[a] = std::min(low[a], (*p)[a]);
                high[a] = std::max(high[a], (*p)[a]);
            }
        std::array<int, 3> axes{0, 1, 2};
        std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return high[a] - low[a] > high[b] - low[b]; });
        return axes;
    }

    const Domain& domain_;
    double weight_, maximum_;
    std::vector<Brick> bricks_;
};

bool are_near(const VoxelBox& a, const VoxelBox& b, int voxels) {
    for (int axis = 0; axis < 3; ++axis)
        if (a.min[axis] > b.max[axis] + voxels || b.min[axis] > a.max[axis] + voxels) return false;
    return true;
}

}  // namespace

std::vector<Brick> split(const Domain& domain, const FloatGrid& coarse, const BrickOptions& options) {
    std::vector<Place> places = places_of(domain, coarse);
    // The band is equally many voxels wide on both lattices, but its area in fine voxels is factor^2 times its area in
    // coarse voxels. One coarse voxel of the band therefore stands for factor^2 fine ones.
    const double factor = coarse.voxelSize()[0] / domain.voxel_size;
    Splitter splitter(domain, factor * factor, options);
    splitter.split({domain.min, domain.max}, places.begin(), places.end());
    std::vector<Brick> bricks = std::move(splitter).bricks();
    for (std::size_t n = 0; n < bricks.size(); ++n)
        for (std::size_t m = 0; m < bricks.size(); ++m)
            if (m != n && are_near(bricks[n].core, bricks[m].core, options.overlap)) bricks[n].neighbours.push_back(m);
    return bricks;
}

Domain around(const Domain& domain, const VoxelBox& core, int layers) {
    Domain part = domain;
    for (int a = 0; a < 3; ++a) {
        part.min[a] = std::max(domain.min[a], core.min[a] - layers);
        part.max[a] = std::min(domain.max[a], core.max[a] + layers);
    }
    return part;
}

}  // namespace covol::bricks
