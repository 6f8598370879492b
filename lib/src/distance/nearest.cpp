#include "distance/nearest.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>

#include "base/number.h"
#include "covol/error.h"
#include "distance/nearest_kernel.h"

namespace covol::detail {
namespace {

constexpr std::int64_t kMaxLeavesPerAxis = 1 << 21;

Coord leaf_origin(const Coord& voxel) { return voxel & ~(kLeafDim - 1); }

Coord voxel_of(const Vec3& p) { return {round_down(p[0] + 0.5), round_down(p[1] + 0.5), round_down(p[2] + 0.5)}; }

/// For each of a leaf's 26 neighbours, the voxels of the leaf that touch it.
std::array<LeafMask, 27> border_masks() {
    std::array<LeafMask, 27> masks{};
    const auto touches = [](int voxel, int step) { return step == 0 || voxel == (step < 0 ? 0 : 7); };
    for (int slot = 0; slot < 27; ++slot) {
        const Coord step = neighbour_step(slot);
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j)
                for (int k = 0; k < 8; ++k)
                    if (slot != 13 && touches(i, step.x()) && touches(j, step.y()) && touches(k, step.z()))
                        set_on(masks[slot], leaf_offset(i, j, k));
    }
    return masks;
}

/// The points of one leaf: field.points[begin, end).
struct Bin {
    std::size_t begin = 0, end = 0;
};

class Sweeper {
public:
    Sweeper(const CoordBBox& box, double radius, const std::function<bool(const Coord&)>& enters)
        : box_(box), radius_(radius), enters_(enters) {}

    void take(const std::vector<Vec3>& points, const char* where);
    void seed();
    void sweep(const RunContext& run);
    NearestField field;

private:
    using Key = std::uint64_t;
    Key key(const Coord& origin) const {
        const auto at = [&](int a) { return Key((origin[a] >> 3) - (box_.min()[a] >> 3) + 1); };
        return at(0) << 44 | at(1) << 22 | at(2);
    }
    bool may_enter(const Coord& origin) const {
        for (int a = 0; a < 3; ++a)
            if (origin[a] > box_.max()[a] || origin[a] + kLeafDim - 1 < box_.min()[a]) return false;
        return !enters_ || enters_(origin);
    }
    std::int32_t touch(const Coord& origin);
    void seed_leaf(NearestLeaf& leaf) const;
    void load(const NearestLeaf& leaf, NearestBlock& block) const;
    void visit(NearestLeaf& leaf);

    CoordBBox box_;
    double radius_;
    const std::function<bool(const Coord&)>& enters_;
    std::unordered_map<Key, std::int32_t> lookup_;
    std::unordered_map<Key, Bin> bins_;
    std::vector<std::array<std::int8_t, 3>> local_;  // voxel of each point within its leaf
    std::vector<std::int32_t> colours_[8];
    const std::array<LeafMask, 27> borders_ = border_masks();
};

/// Keeps the points that can reach the box, sorted by leaf; enlarges the box so that it contains all of them.
void Sweeper::take(const std::vector<Vec3>& points, const char* where) {
    const auto reaches = [this](const Vec3& p) {
        double squared = 0;
        for (int a = 0; a < 3; ++a) {
            const double out = std::max({box_.min()[a] - p[a], p[a] - box_.max()[a], 0.0});
            squared += out * out;
        }
        return squared <= radius_ * radius_;
    };
    const auto both = [](CoordBBox one, const CoordBBox& other) {
        one.expand(other);
        return one;
    };
    constexpr std::size_t kAtOnce = 4096;  // points
    std::vector<Coord> voxels(points.size());
    std::vector<unsigned char> is_kept(points.size());
    const CoordBBox wide = tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, points.size(), kAtOnce), box_,
        [&](const auto& range, CoordBBox box) {
            for (std::size_t n = range.begin(); n != range.end(); ++n) {
                is_kept[n] = reaches(points[n]);
                if (!is_kept[n]) continue;
                voxels[n] = voxel_of(points[n]);
                box.expand(voxels[n]);
            }
            return box;
        },
        both);
    box_ = wide;
    for (int a = 0; a < 3; ++a)
        if ((std::int64_t(box_.max()[a]) - box_.min()[a]) / kLeafDim + 4 > kMaxLeavesPerAxis)
            throw Error(Errc::InvalidInput,
                        std::string(where) + ": the domain has " +
                            std::to_string(std::int64_t(box_.max()[a]) - box_.min()[a] + 1) +
                            " voxels along an axis, expected at most 2^24; use a larger voxel size");
    std::vector<std::pair<Key, std::int32_t>> order;
    order.reserve(points.size());
    for (std::size_t n = 0; n < points.size(); ++n)
        if (is_kept[n]) order.emplace_back(key(leaf_origin(voxels[n])), std::int32_t(n));
    tbb::parallel_sort(order.begin(), order.end());
    field.points.resize(order.size());
    field.source.resize(order.size());
    local_.resize(order.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, order.size(), kAtOnce), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const auto source = std::size_t(order[n].second);
            const Coord voxel = voxels[source] & (kLeafDim - 1);
            field.points[n] = points[source];
            field.source[n] = order[n].second;
            local_[n] = {std::int8_t(voxel.x()), std::int8_t(voxel.y()), std::int8_t(voxel.z())};
        }
    });
    for (std::size_t n = 0, end; n < order.size(); n = end) {
        for (end = n + 1; end < order.size() && order[end].first == order[n].first;) ++end;
        bins_[order[n].first] = {n, end};
    }
}

std::int32_t Sweeper::touch(const Coord& origin) {
    const auto [at, is_new] = lookup_.try_emplace(key(origin), std::int32_t(field.leaves.size()));
    if (!is_new) return at->second;
    const std::int32_t id = at->second;
    NearestLeaf& leaf = field.leaves.emplace_back();
    leaf.origin = origin;
    leaf.nearest.fill(-1);
    leaf.queued = true;
    for (int slot = 0; slot < 27; ++slot) {
        const auto found = lookup_.find(key(neighbour_origin(origin, slot)));
        leaf.neighbours[slot] = found == lookup_.end() ? -1 : found->second;
        if (found != lookup_.end()) field.leaves[found->second].neighbours[26 - slot] = id;
    }
    colours_[(origin.x() >> 3 & 1) << 2 | (origin.y() >> 3 & 1) << 1 | (origin.z() >> 3 & 1)].push_back(id);
    return id;
}

/// Each voxel takes the nearest of the points in the 3^3 voxels around it. Up to a distance of 1.5 voxels, this is the
/// nearest of all points.
void Sweeper::seed_leaf(NearestLeaf& leaf) const {
    std::array<float, kLeafSize> squared;
    squared.fill(NearestBlock::kFar);
    const Coord& o = leaf.origin;
    for (int slot = 0; slot < 27; ++slot) {
        const auto bin = bins_.find(key(neighbour_origin(o, slot)));
        if (bin == bins_.end()) continue;
        const Coord step = neighbour_step(slot);
        for (std::size_t n = bin->second.begin; n < bin->second.end; ++n) {
            Coord lo, hi;
            bool reaches = true;
            for (int a = 0; a < 3; ++a) {
                const int at = local_[n][std::size_t(a)] + step[a] * kLeafDim;
                lo[a] = std::max(at - 1, 0);
                hi[a] = std::min(at + 1, kLeafDim - 1);
                reaches = reaches && lo[a] <= hi[a];
            }
            if (!reaches) continue;
            const Vec3& p = field.points[n];
            const float x = float(p[0] - o.x()), y = float(p[1] - o.y()), z = float(p[2] - o.z());
            for (int i = lo.x(); i <= hi.x(); ++i)
                for (int j = lo.y(); j <= hi.y(); ++j)
                    for (int k = lo.z(); k <= hi.z(); ++k) {
                        const float dx = x - float(i), dy = y - float(j), dz = z - float(k);
                        const float s = dx * dx + dy * dy + dz * dz;
                        const int at = leaf_offset(i, j, k);
                        if (s < squared[at]) {
                            squared[at] = s;
                            leaf.nearest[at] = std::int32_t(n);
                        }
                    }
        }
    }
}

void Sweeper::seed() {
    // Leaves are created in the order of the points, so that their numbers do not depend on hashing.
    for (std::size_t n = 0; n < field.points.size();) {
        const Coord o = leaf_origin(voxel_of(field.points[n]));
        const Bin bin = bins_.at(key(o));
        std::uint32_t reached = 0;
        for (; n < bin.end; ++n) {
            const auto& v = local_[n];
            const auto lo = [&](std::size_t a) { return v[a] == 0 ? -1 : 0; };
            const auto hi = [&](std::size_t a) { return v[a] == kLeafDim - 1 ? 1 : 0; };
            for (int i = lo(0); i <= hi(0); ++i)
                for (int j = lo(1); j <= hi(1); ++j)
                    for (int k = lo(2); k <= hi(2); ++k) reached |= 1U << neighbour_slot(i, j, k);
        }
        for (int slot = 0; slot < 27; ++slot) {
            const Coord origin = neighbour_origin(o, slot);
            if ((reached >> slot & 1) && may_enter(origin)) touch(origin);
        }
    }
    tbb::parallel_for(std::size_t(0), field.leaves.size(), [&](std::size_t n) { seed_leaf(field.leaves[n]); });
}

/// Reads point coordinates once for each run of equal indices.
class PointReader {
public:
    PointReader(const NearestField& field, const Coord& origin) : field_(field), o_(origin) {}
    void read(std::int32_t index, NearestBlock& block, int at) {
        if (index != last_) {
            last_ = index;
            if (index >= 0) {
                const Vec3& p = field_.points[std::size_t(index)];
                x_ = float(p[0] - o_.x()), y_ = float(p[1] - o_.y()), z_ = float(p[2] - o_.z());
            } else {
                x_ = y_ = z_ = NearestBlock::kFar;
            }
        }
        block.x[at] = x_, block.y[at] = y_, block.z[at] = z_, block.index[at] = index;
    }

private:
    const NearestField& field_;
    const Coord o_;
    std::int32_t last_ = -1;
    float x_ = NearestBlock::kFar, y_ = NearestBlock::kFar, z_ = NearestBlock::kFar;
};

void load_interior(const NearestField& field, const NearestLeaf& leaf, NearestBlock& block) {
    PointReader reader(field, leaf.origin);
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j)
            for (int k = 0; k < 8; ++k)
                reader.read(leaf.nearest[leaf_offset(i, j, k)], block, NearestBlock::offset(i, j, k));
}

void Sweeper::load(const NearestLeaf& leaf, NearestBlock& block) const {
    load_interior(field, leaf, block);
    PointReader reader(field, leaf.origin);
    // Along an axis, indices of the first and the last voxel that are read from a neighbour at step -1, 0 or 1,
    // relative to this leaf.
    constexpr int kFirst[3] = {-1, 0, 8}, kLast[3] = {-1, 7, 8};
    for (int slot = 0; slot < 27; ++slot) {
        if (slot == 13) continue;
        const Coord s = neighbour_step(slot).offsetBy(1);
        const NearestLeaf* other = leaf.neighbours[slot] < 0 ? nullptr : &field.leaves[leaf.neighbours[slot]];
        for (int i = kFirst[s.x()]; i <= kLast[s.x()]; ++i)
            for (int j = kFirst[s.y()]; j <= kLast[s.y()]; ++j)
                for (int k = kFirst[s.z()]; k <= kLast[s.z()]; ++k)
                    reader.read(other ? other->nearest[leaf_offset(i & 7, j & 7, k & 7)] : -1, block,
                                NearestBlock::offset(i, j, k));
    }
}

void Sweeper::visit(NearestLeaf& leaf) {
    NearestBlock block;
    load(leaf, block);
    sweep_nearest(block);
    const float reach = float(radius_ * radius_);
    LeafMask changed;
    store_points(block, reach, !leaf.visited, leaf.nearest.data(), changed.data());
    leaf.visited = true;
    leaf.affected = 0;
    // If two points are equally distant, rounding may make each of two leaves prefer a different one. Only a leaf that
    // has changed notifies its neighbours, so that they do not continue to notify each other.
    if (!any_on(changed)) return;
    const unsigned faces = improved_faces(block, reach);
    for (int face = 0; face < 6; ++face) leaf.affected |= (faces >> face & 1) << kFaceSlots[face];
    // Existing neighbours are notified across faces only. Changes at edges and corners matter for neighbours that do
    // not exist yet and have to be created.
    for (int slot = 0; slot < 27; ++slot) {
        std::uint64_t any = 0;
        if (leaf.neighbours[slot] < 0)
            for (int word = 0; word < 8; ++word) any |= changed[word] & borders_[slot][word];
        leaf.affected |= std::uint32_t(any != 0) << slot;
    }
}

void Sweeper::sweep(const RunContext& run) {
    for (bool any = true; any;) {
        any = false;
        run.check();
        for (auto& colour : colours_) {
            std::vector<std::int32_t> list;
            for (const std::int32_t id : colour)
                if (field.leaves[id].queued) list.push_back(id);
            tbb::parallel_for(std::size_t(0), list.size(), [&](std::size_t n) { visit(field.leaves[list[n]]); });
            any = any || !list.empty();
            for (const std::int32_t id : list) field.leaves[id].queued = false;
            for (const std::int32_t id : list) {
                const NearestLeaf& leaf = field.leaves[id];
                for (int slot = 0; slot < 27; ++slot) {
                    if (!(leaf.affected >> slot & 1)) continue;
                    if (leaf.neighbours[slot] >= 0) {
                        field.leaves[leaf.neighbours[slot]].queued = true;
                    } else {
                        const Coord origin = neighbour_origin(leaf.origin, slot);
                        if (may_enter(origin)) touch(origin);
                    }
                }
            }
        }
        field.rounds += any;
    }
}

}  // namespace

NearestField nearest_points(const std::vector<Vec3>& points, const CoordBBox& box, double radius, const char* where,
                            const RunContext& run, const std::function<bool(const Coord&)>& enters) {
    Sweeper sweeper(box, radius, enters);
    sweeper.take(points, where);
    sweeper.seed();
    sweeper.sweep(run);
    return std::move(sweeper.field);
}

void squared_distances(const NearestField& field, const NearestLeaf& leaf, float* squared) {
    NearestBlock block;
    load_interior(field, leaf, block);
    squared_distances(block, squared);
}

}  // namespace covol::detail
