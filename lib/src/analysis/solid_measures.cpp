#include "covol/solid_measures.h"

#include <openvdb/openvdb.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "covol/error.h"

namespace covol {
namespace {

using openvdb::Coord, openvdb::Vec3d;

/// Volume, first moment and bounding box of the part of some voxels that is inside the surface, with lengths in voxels.
struct Moments {
    double volume = 0;
    Vec3d moment{0, 0, 0};
    Vec3d low{std::numeric_limits<double>::max()}, high{-std::numeric_limits<double>::max()};

    void add(double fraction, const Vec3d& at) {
        volume += fraction;
        moment += fraction * at;
    }
    void reach(const Vec3d& at) {
        low = openvdb::math::minComponent(low, at);
        high = openvdb::math::maxComponent(high, at);
    }
    void add(const Moments& other) {
        volume += other.volume;
        moment += other.moment;
        low = openvdb::math::minComponent(low, other.low);
        high = openvdb::math::maxComponent(high, other.high);
    }
};

class LeafMeasure {
public:
    explicit LeafMeasure(const FloatGrid& surface)
        : accessor_(surface.getConstAccessor()), h_(surface.voxelSize()[0]) {}

    [[nodiscard]] Moments of(const FloatGrid::TreeType::LeafNodeType& leaf) const {
        Moments part;
        for (auto value = leaf.cbeginValueAll(); value; ++value) {
            const double d = *value / h_;
            const Coord at = value.getCoord();
            part.add(std::clamp(0.5 - d, 0.0, 1.0), at.asVec3d());
            if (!(d < 0)) continue;
            for (int face = 0; face < 6; ++face) {
                Coord next = at;
                next[face / 2] += face % 2 == 0 ? 1 : -1;
                const double other = accessor_.getValue(next) / h_;
                if (other < 0) continue;
                Vec3d crossing = at.asVec3d();
                crossing[face / 2] += (next[face / 2] - at[face / 2]) * d / (d - other);
                part.reach(crossing);
            }
        }
        return part;
    }

private:
    FloatGrid::ConstAccessor accessor_;
    double h_;
};

}  // namespace

SolidMeasures measure_solid(const FloatGrid& surface, const RunContext& run) {
    Moments all;
    with_threads(run, [&] {
        const openvdb::tree::LeafManager<const FloatGrid::TreeType> leaves(surface.tree());
        std::vector<Moments> parts(leaves.leafCount());
        tbb::parallel_for(std::size_t(0), parts.size(), [&](std::size_t n) {
            if (!run.cancelled()) parts[n] = LeafMeasure(surface).of(leaves.leaf(n));
        });
        for (const Moments& part : parts) all.add(part);
        // Tiles with a negative value are boxes of voxels that are entirely inside.
        auto tile = surface.cbeginValueAll();
        tile.setMaxDepth(FloatGrid::ValueAllCIter::LEAF_DEPTH - 1);
        for (; tile; ++tile)
            if (*tile < 0) {
                const openvdb::CoordBBox box = tile.getBoundingBox();
                all.add(double(box.volume()), (box.min().asVec3d() + box.max().asVec3d()) / 2);
            }
    });
    run.check();
    if (!(all.volume > 0) || all.low[0] > all.high[0])
        throw Error(Errc::InvalidInput, "measures of a solid: expected a surface that encloses a volume");
    const auto to_world = [&](const Vec3d& at) {
        const Vec3d world = surface.indexToWorld(at);
        return Vec3{world[0], world[1], world[2]};
    };
    return {to_world(all.moment / all.volume), {to_world(all.low), to_world(all.high)}};
}

double sphericity(double volume, double area) {
    return area > 0 ? std::cbrt(std::numbers::pi) * std::pow(6 * std::max(volume, 0.0), 2.0 / 3) / area : 0;
}

}  // namespace covol
