#include "clip/clipped.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Prune.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/geometry.h"
#include "clip/half_spaces.h"
#include "grid/leaf_band.h"

namespace covol::detail {
namespace {

using Accessor = FloatGrid::ConstAccessor;

constexpr double kMinCell = 0.1;        // [voxels] a layer that is closer than this to a face is moved onto it
constexpr float kSameDistance = 1e-3F;  // [voxels] tolerance within which a value is regarded as the distance to a face

openvdb::CoordBBox voxels_of(const Domain& d) {
    return {Coord(d.min[0], d.min[1], d.min[2]), Coord(d.max[0], d.max[1], d.max[2])};
}

/// Sets all voxels beyond the domain to the background, inactive. FloatGrid::clip() would also split the tiles outside
/// of the solid along the faces of the domain into leaves: 360 MB for an image of 2048^3 voxels.
void limit_to(const openvdb::CoordBBox& domain, FloatGrid& grid) {
    const float outside = grid.background();
    for (auto leaf = grid.tree().beginLeaf(); leaf; ++leaf)
        if (!domain.isInside(leaf->getNodeBoundingBox())) leaf->clip(domain, outside);
    std::vector<openvdb::CoordBBox> tiles;
    auto tile = grid.tree().cbeginValueAll();
    tile.setMaxDepth(FloatGrid::TreeType::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) {
        openvdb::CoordBBox box;
        tile.getBoundingBox(box);
        if (*tile != outside && !domain.isInside(box)) tiles.push_back(box);
    }
    for (const openvdb::CoordBBox& box : tiles)
        for (int a = 0; a < 3; ++a) {
            openvdb::CoordBBox low = box, high = box;
            low.max()[a] = std::min(box.max()[a], domain.min()[a] - 1);
            high.min()[a] = std::max(box.min()[a], domain.max()[a] + 1);
            for (const openvdb::CoordBBox& beyond : {low, high})
                if (!beyond.empty()) grid.fill(beyond, outside, false);
        }
}

/// Trilinear samples of a grid that is known on a domain, extrapolated linearly beyond the last voxel centres.
class DomainSampler {
public:
    DomainSampler(const FloatGrid& grid, const Domain& domain) : accessor_(grid.getConstAccessor()), domain_(domain) {}

    [[nodiscard]] double operator()(const Vec3& world) const {
        const Vec3 at = domain_.world_to_index(world);
        Vec3 within;
        for (int a = 0; a < 3; ++a) within[a] = std::clamp(at[a], double(domain_.min[a]), double(domain_.max[a]));
        const double here = inside(within);
        double value = here;
        for (int a = 0; a < 3; ++a) {
            const double beyond = at[a] - within[a];
            if (beyond == 0) continue;
            Vec3 before = within;
            before[a] = std::clamp(before[a] - (beyond > 0 ? 1 : -1), double(domain_.min[a]), double(domain_.max[a]));
            value += std::abs(beyond) * (here - inside(before));
        }
        return value;
    }

private:
    [[nodiscard]] double inside(const Vec3& at) const {
        Coord base;
        Vec3 t;
        for (int a = 0; a < 3; ++a) {
            base[a] = std::min(int(std::floor(at[a])), domain_.max[a]);
            t[a] = at[a] - base[a];
        }
        double sum = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const Coord c(corner >> 2 & 1, corner >> 1 & 1, corner & 1);
            double weight = 1;
            for (int a = 0; a < 3; ++a) weight *= c[a] != 0 ? t[a] : 1 - t[a];
            if (weight > 0) sum += weight * double(accessor_.getValue(base + c));
        }
        return sum;
    }

    Accessor accessor_;
    const Domain& domain_;
};

class Clipper {
public:
    Clipper(FloatGrid& grid, const Domain& domain, const Clip& clip)
        : grid_(grid), domain_(domain), clip_(clip), width_(double(grid.background())) {}

    void cut() {
        limit_to(voxels_of(domain_), grid_);
        const std::vector<Coord> origins = blocks();
        std::vector<Block> results(origins.size());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, origins.size(), 16), [&](const auto& range) {
            const DomainSampler sample(grid_, domain_);
            const Accessor accessor = grid_.getConstAccessor();
            for (std::size_t n = range.begin(); n != range.end(); ++n)
                evaluate(origins[n], sample, accessor, results[n]);
        });
        for (std::size_t n = 0; n < origins.size(); ++n) {
            // A block within a tile that the cut does not change needs no leaf.
            if (!any_on(results[n].active) && grid_.tree().probeConstLeaf(origins[n]) == nullptr &&
                grid_.tree().getValue(origins[n]) == results[n].values[0])
                continue;
            auto* leaf = grid_.tree().touchLeaf(origins[n]);
            std::copy_n(results[n].values.data(), kLeafSize, leaf->buffer().data());
            auto mask = leaf->valueMask();
            for (int word = 0; word < 8; ++word) mask.template getWord<std::uint64_t>(word) = results[n].active[word];
            leaf->setValueMask(mask);
        }
        openvdb::tools::pruneLevelSet(grid_.tree());
    }

private:
    struct Block {
        std::array<float, kLeafSize> values{};
        LeafMask active{};
    };

    [[nodiscard]] Vec3 world(const Coord& voxel) const {
        return domain_.index_to_world({double(voxel[0]), double(voxel[1]), double(voxel[2])});
    }

    /// Whether a box may contain voxels outside the clip, or voxels inside it that are closer to its boundary than the
    /// half width of the band.
    [[nodiscard]] bool near_clip(const openvdb::CoordBBox& box) const {
        const Vec3 lo = world(box.min()), hi = world(box.max());
        double highest = -LatticeClip::kFar;
        for (const HalfSpace& plane : clip_) {
            double center = -plane.offset, reach = 0;
            for (int a = 0; a < 3; ++a) {
                center += plane.normal[a] * 0.5 * (lo[a] + hi[a]);
                reach += std::abs(plane.normal[a]) * 0.5 * (hi[a] - lo[a]);
            }
            highest = std::max(highest, center + reach);
        }
        return highest > -width_;
    }

    /// Appends the blocks of 8^3 voxels of a box that are near the clip.
    void add_blocks(const openvdb::CoordBBox& box, std::vector<Coord>& blocks) const {
        if (!near_clip(box)) return;
        const int longest = int(box.dim().maxIndex());
        const int sides = box.dim()[longest] / kLeafDim;
        if (sides <= 1) return blocks.push_back(box.min());
        openvdb::CoordBBox low = box, high = box;
        low.max()[longest] = box.min()[longest] + (sides / 2) * kLeafDim - 1;
        high.min()[longest] = low.max()[longest] + 1;
        add_blocks(low, blocks);
        add_blocks(high, blocks);
    }

    /// The origins of all blocks that the cut can change: those near the clip that intersect the solid or are adjacent
    /// to such a block.
    [[nodiscard]] std::vector<Coord> blocks() const {
        std::vector<Coord> solid;
        for (auto leaf = grid_.tree().cbeginLeaf(); leaf; ++leaf)
            if (near_clip(openvdb::CoordBBox(leaf->origin(), leaf->origin().offsetBy(kLeafDim - 1))))
                solid.push_back(leaf->origin());
        auto tile = grid_.tree().cbeginValueAll();
        tile.setMaxDepth(FloatGrid::TreeType::ValueAllCIter::LEAF_DEPTH - 1);
        for (; tile; ++tile) {
            if (!(*tile < 0)) continue;
            openvdb::CoordBBox box;
            tile.getBoundingBox(box);
            add_blocks(box, solid);
        }
        std::vector<Coord> all = dilate_leaves(solid, 1, widened(domain_, kLeafDim));
        std::erase_if(all, [&](const Coord& o) { return !near_clip(openvdb::CoordBBox(o, o.offsetBy(kLeafDim - 1))); });
        return all;
    }

    void evaluate(const Coord& origin, const DomainSampler& sample, const Accessor& accessor, Block& block) const {
        for (int p = 0; p < kLeafSize; ++p) {
            const Coord at = origin.offsetBy(p >> 6, p >> 3 & 7, p & 7);
            const Vec3 x = world(at);
            const double depth = depth_in(clip_, x);
            double value = width_;
            if (depth <= 0) {
                const double wall = accessor.getValue(at);
                value = wall < 0 ? std::max(wall, depth) : wall;
            } else if (depth < width_) {
                const Vec3 nearest = projected(clip_, x);
                const double wall = sample(nearest);
                const double away = length(minus(x, nearest));
                value = wall < 0 ? away : std::hypot(wall, away);
            }
            block.values[p] = float(std::clamp(value, -width_, width_));
            if (std::abs(value) < width_) set_on(block.active, p);
        }
    }

    FloatGrid& grid_;
    const Domain& domain_;
    const Clip& clip_;
    double width_;  // half width of the band, world units
};

/// Undoes the cut at one face after the other. The distance to the wall, the surface of the solid itself, is stored
/// only in voxels that are closer to the wall than to the face; it is extrapolated from them, column by column, towards
/// and beyond the face.
class Restorer {
public:
    Restorer(const FloatGrid& surface, const LatticeClip& clip, const Clip& planes, FaceLayer layer)
        : grid_(surface.deepCopy()),
          clip_(clip),
          planes_(planes),
          domain_(domain_of(surface)),
          layer_(layer),
          width_(surface.background()) {}

    std::optional<Uncut> run() {
        Uncut result;
        bool any = false;
        for (int axis = 0; axis < 3; ++axis)
            for (const bool upper : {false, true}) {
                const double face = upper ? clip_.high[axis] : clip_.low[axis];
                if (std::isinf(face) || !restore(axis, upper)) continue;
                any = true;
                (upper ? result.clip.high : result.clip.low)[axis] = face;
            }
        if (!any) return {};
        result.distance = grid_;
        return result;
    }

private:
    /// Number of layers of voxels, counted from the face inward, whose distances are read. In up to three of them, the
    /// grid may contain the distance to the face, because the face is nearer than the wall. Two more layers are needed
    /// to determine the slope of the distance to the wall.
    static constexpr int kDepth = 5;

    /// @return whether the solid meets this face.
    bool restore(int axis, bool upper) {
        const int beyond = clip_.face_layer(axis, upper), inward = upper ? -1 : 1, last = beyond + inward;
        const double gap = std::abs((upper ? clip_.high[axis] : clip_.low[axis]) - last);
        const int layers = layer_ == FaceLayer::OnFace ? 1 : kCarriedOn;
        const double first = layer_ == FaceLayer::OnFace ? gap : 1.0;
        std::vector<Coord> origins;
        for (auto leaf = grid_->tree().cbeginLeaf(); leaf; ++leaf)
            if ((last & ~(kLeafDim - 1)) == leaf->origin()[axis]) origins.push_back(leaf->origin());
        auto accessor = grid_->getAccessor();
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        bool meets = false;
        for (const Coord& origin : origins)
            for (int i = 0; i < kLeafDim; ++i)
                for (int j = 0; j < kLeafDim; ++j) {
                    Coord at;
                    at[u] = origin[u] + i;
                    at[v] = origin[v] + j;
                    at[axis] = last;
                    std::array<float, kDepth> wall = column(accessor, at, axis, inward);
                    if (wall[0] >= width_ && wall[1] >= width_) continue;
                    for (int n = 0; n < 3; ++n) {
                        Coord voxel = at;
                        voxel[axis] += n * inward;
                        accessor.setValueOnly(voxel, wall[n]);
                    }
                    for (int n = 0; n < layers; ++n) {
                        const auto end = float(
                            std::clamp(wall[0] + (first + n) * (wall[0] - wall[1]), -double(width_), double(width_)));
                        at[axis] = beyond - n * inward;
                        accessor.setValueOnly(at, end);
                        meets = meets || end < 0;
                    }
                    meets = meets || wall[0] < 0;
                }
        return meets;
    }

    /// The distance to the wall in the layers from `at` inward. In layers that contain the distance to the face
    /// instead, it is extrapolated from the layers farther inward.
    [[nodiscard]] std::array<float, kDepth> column(const FloatGrid::Accessor& accessor, Coord at, int axis,
                                                   int inward) const {
        std::array<float, kDepth> wall;
        std::array<bool, kDepth> hidden;
        for (int n = 0; n < kDepth; ++n, at[axis] += inward) {
            wall[n] = accessor.getValue(at);
            const double depth =
                depth_in(planes_, domain_.index_to_world({double(at[0]), double(at[1]), double(at[2])}));
            hidden[n] = depth < 0 && std::abs(wall[n] - depth) < kSameDistance * domain_.voxel_size;
        }
        if (!hidden[0]) return wall;
        int seen = 1;
        while (seen < kDepth && hidden[seen]) ++seen;
        const bool known = seen < kDepth && wall[seen] > -width_;
        const float slope = known && seen + 1 < kDepth && !hidden[seen + 1] && wall[seen + 1] > -width_
                                ? wall[seen] - wall[seen + 1]
                                : 0.0F;
        for (int n = 0; n < std::min(seen, kDepth); ++n)
            wall[n] = known ? std::clamp(wall[seen] + float(seen - n) * slope, -width_, wall[n]) : -width_;
        return wall;
    }

    FloatGridPtr grid_;
    LatticeClip clip_;
    const Clip& planes_;
    Domain domain_;
    FaceLayer layer_;
    float width_;
};

/// The clip in index space; none if a plane is not perpendicular to an axis of the lattice.
std::optional<LatticeClip> on_lattice(const Clip& planes, const Domain& domain) {
    LatticeClip clip;
    for (const HalfSpace& plane : planes) {
        int axis = -1;
        for (int a = 0; a < 3; ++a)
            if (std::abs(plane.normal[a]) > 1 - 1e-9) axis = a;
        if (axis < 0) return {};
        const bool upper = plane.normal[axis] > 0;
        const double at = ((upper ? plane.offset : -plane.offset) - domain.origin[axis]) / domain.voxel_size;
        double& face = (upper ? clip.high : clip.low)[axis];
        face = upper ? std::min(face, at) : std::max(face, at);
    }
    return clip;
}

}  // namespace

double depth_in(const Clip& clip, const Vec3& x) {
    double depth = -std::numeric_limits<double>::infinity();
    for (const HalfSpace& plane : clip) depth = std::max(depth, along(plane, x));
    return depth;
}

int LatticeClip::face_layer(int axis, bool upper) const {
    return upper ? int(std::ceil(high[axis] - kMinCell)) : int(std::floor(low[axis] + kMinCell));
}

double LatticeClip::position(int axis, int layer) const {
    if (!std::isinf(high[axis]) && layer >= face_layer(axis, true)) return high[axis];
    if (!std::isinf(low[axis]) && layer <= face_layer(axis, false)) return low[axis];
    return layer;
}

FloatGridPtr clipped(FloatGridPtr distance, const Domain& domain, const Clip& clip) {
    Clipper(*distance, domain, clip).cut();
    set_clip(*distance, clip);
    return distance;
}

std::optional<Uncut> uncut(const FloatGrid& surface, FaceLayer layer) {
    const Clip planes = clip_of(surface);
    if (planes.empty()) return {};
    const std::optional<LatticeClip> clip = on_lattice(planes, domain_of(surface));
    if (!clip) return {};
    return Restorer(surface, *clip, planes, layer).run();
}

}  // namespace covol::detail
