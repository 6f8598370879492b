#include "surface/rasterizer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "grid/leaf_band.h"

namespace covol::detail {
namespace {

using openvdb::Coord;
using Accessor = FloatGrid::ConstAccessor;

/// [voxels] Absolute distance at a cell's corner above which the whole cell has one sign, because a distance changes by
/// at most sqrt(3) voxels within a cell.
constexpr float kCertain = 1.8F;

/// Edge, in voxels, of the tile of the tree that contains a voxel without a leaf.
int tile_size(Accessor& accessor, const Coord& voxel) {
    using Tree = FloatGrid::TreeType;
    using Upper = Tree::RootNodeType::ChildNodeType;
    using Lower = Upper::ChildNodeType;
    switch (accessor.getValueDepth(voxel)) {
        case -1:
        case 0: return int(Upper::DIM);
        case 1: return int(Lower::DIM);
        default: return kLeafDim;
    }
}

/// Determines, voxel by voxel along a row of an image, whether a level set is negative.
class RowSampler {
public:
    explicit RowSampler(const FloatGrid& grid)
        : accessor_(grid.getConstAccessor()), certain_(kCertain * static_cast<float>(grid.voxelSize()[0])) {}

    /// Sets out[n - first] to the label for those positions from + n * step (index space), first <= n < end, that are
    /// inside.
    void fill(const openvdb::Vec3d& from, const openvdb::Vec3d& step, int first, int end, std::uint8_t label,
              std::uint8_t* out) {
        for (int n = first; n < end;) {
            const openvdb::Vec3d at = from + double(n) * step;
            const Coord base = Coord::floor(at);
            int run = 1;
            float value = 0;
            if (const auto* leaf = accessor_.probeConstLeaf(base)) {
                value = leaf->getValue(base);
            } else {
                value = accessor_.getValue(base);
                run = std::min(end - n, steps_inside_tile(at, base, step, tile_size(accessor_, base)));
            }
            if (std::abs(value) < certain_) {
                run = 1;
                value = interpolate(at, base);
            }
            if (value < 0) std::fill_n(out + (n - first), run, label);
            n += run;
        }
    }

private:
    /// The number of successive positions, `at` included, in the tile of this size that contains `base`; at least 1.
    static int steps_inside_tile(const openvdb::Vec3d& at, const Coord& base, const openvdb::Vec3d& step, int size) {
        double steps = std::numeric_limits<std::int32_t>::max();
        for (int a = 0; a < 3; ++a) {
            const int low = base[a] & ~(size - 1);
            // A margin prevents rounding from including a position of the next tile.
            if (step[a] > 1e-12) steps = std::min(steps, (low + size - 1e-6 - at[a]) / step[a]);
            if (step[a] < -1e-12) steps = std::min(steps, (low + 1e-6 - at[a]) / step[a]);
        }
        return steps > 0 ? 1 + static_cast<int>(std::min(steps, 1e9)) : 1;
    }

    float interpolate(const openvdb::Vec3d& at, const Coord& base) {
        const float x = static_cast<float>(at[0] - base[0]), y = static_cast<float>(at[1] - base[1]),
                    z = static_cast<float>(at[2] - base[2]);
        const auto along_z = [&](int i, int j) {
            const float a = accessor_.getValue(base.offsetBy(i, j, 0)), b = accessor_.getValue(base.offsetBy(i, j, 1));
            return a + z * (b - a);
        };
        const auto along_y = [&](int i) {
            const float a = along_z(i, 0);
            return a + y * (along_z(i, 1) - a);
        };
        const float a = along_y(0);
        return a + x * (along_y(1) - a);
    }

    FloatGrid::ConstAccessor accessor_;
    float certain_;
};

/// Whether the centres of all the lattice's voxels lie in the clip.
bool lies_within(const ImageGeometry& geometry, const Clip& clip) {
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 index;
        for (int a = 0; a < 3; ++a) index[a] = (corner >> a & 1) != 0 ? geometry.size[a] - 1.0 : 0.0;
        if (detail::depth_in(clip, geometry.index_to_world(index)) > 0) return false;
    }
    return true;
}

}  // namespace

Rasterizer::Rasterizer(const FloatGrid& surface, const ImageGeometry& geometry)
    : surface_(surface),
      geometry_(geometry),
      domain_(domain_of(surface)),
      whole_(uncut(surface, FaceLayer::InPlace)),
      clip_(whole_ ? clip_of(surface) : Clip{}),
      all_within_(lies_within(geometry, clip_)) {}

openvdb::Vec3d Rasterizer::to_index(double i, double j, double k) const {
    const Vec3 at = domain_.world_to_index(geometry_.index_to_world({i, j, k}));
    return {at[0], at[1], at[2]};
}

void Rasterizer::fill(const VoxelBox& box, std::uint8_t label, std::uint8_t* out) const {
    RowSampler sampler(grid());
    const openvdb::Vec3d step = to_index(1, 0, 0) - to_index(0, 0, 0);
    const int first = box.min[0], end = box.max[0] + 1;
    std::vector<std::uint8_t> row(std::size_t(end - first));
    for (int k = box.min[2]; k <= box.max[2]; ++k)
        for (int j = box.min[1]; j <= box.max[1]; ++j, out += end - first) {
            std::fill(row.begin(), row.end(), 0);
            sampler.fill(to_index(0, j, k), step, first, end, 1, row.data());
            for (int i = first; i < end && !all_within_; ++i)
                if (row[i - first] != 0 &&
                    depth_in(clip_, geometry_.index_to_world({double(i), double(j), double(k)})) > 0)
                    row[i - first] = 0;
            for (int n = 0; n < end - first; ++n)
                if (row[n] != 0) out[n] = label;
        }
}

std::optional<bool> Rasterizer::uniform(const VoxelBox& box) const {
    openvdb::BBoxd centres;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 at{};
        for (int a = 0; a < 3; ++a) at[a] = (corner >> a & 1) != 0 ? box.max[a] : box.min[a];
        centres.expand(to_index(at[0], at[1], at[2]));
    }
    constexpr double kRounding = 1e-6;
    const Coord low = Coord::floor(centres.min() - openvdb::Vec3d(kRounding)),
                high = Coord::floor(centres.max() + openvdb::Vec3d(kRounding));
    Accessor accessor = grid().getConstAccessor();
    const float certain = kCertain * static_cast<float>(grid().voxelSize()[0]);
    std::optional<bool> inside;
    // Tiles begin at multiples of a leaf's edge: steps of one leaf visit all of them, and along z whole tiles are
    // skipped.
    Coord at;
    for (at[0] = low[0]; at[0] <= high[0]; at[0] = (at[0] & ~(kLeafDim - 1)) + kLeafDim)
        for (at[1] = low[1]; at[1] <= high[1]; at[1] = (at[1] & ~(kLeafDim - 1)) + kLeafDim)
            for (at[2] = low[2]; at[2] <= high[2];) {
                if (accessor.probeConstLeaf(at) != nullptr) return std::nullopt;
                const float value = accessor.getValue(at);
                if (std::abs(value) < certain || (inside && *inside != (value < 0))) return std::nullopt;
                inside = value < 0;
                const int size = tile_size(accessor, at);
                at[2] = (at[2] & ~(size - 1)) + size;
            }
    if (inside == true && !all_within_) return std::nullopt;
    return inside;
}

}  // namespace covol::detail
