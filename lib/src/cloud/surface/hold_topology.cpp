#include "cloud/surface/hold_topology.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <queue>
#include <vector>

namespace covol::cloud {
namespace {

using openvdb::Coord;

constexpr std::size_t kCheckEvery = 10'000;  // voxels between two checks for cancellation
// [voxels] Absolute value of target's voxels that keep the sign of rough, whose topology is imposed: far less than a
// voxel, so that they hardly displace the surface, but not 0, so that triangles do not degenerate.
constexpr double kHeld = 0.1;

/// The 26 neighbours of a voxel, one bit each. For each neighbour, `beside6` and `beside18` are the other neighbours
/// that are 6-adjacent and 18-adjacent to it.
struct Neighbourhood {
    std::array<Coord, 26> offset;
    std::array<std::uint32_t, 26> beside6{}, beside18{};
    std::array<float, 26> length{};
    std::uint32_t faces = 0, faces_and_edges = 0;

    Neighbourhood() {
        std::size_t n = 0;
        for (int i = -1; i <= 1; ++i)
            for (int j = -1; j <= 1; ++j)
                for (int k = -1; k <= 1; ++k)
                    if (i != 0 || j != 0 || k != 0) offset[n++] = Coord(i, j, k);
        for (std::size_t a = 0; a < 26; ++a) {
            const int axes = steps(offset[a], Coord(0, 0, 0));
            length[a] = std::sqrt(float(axes));
            if (axes == 1) faces |= 1U << a;
            if (axes <= 2) faces_and_edges |= 1U << a;
            for (std::size_t b = 0; b < 26; ++b) {
                const int apart = steps(offset[a], offset[b]);
                if (apart == 1) beside6[a] |= 1U << b;
                if (apart == 1 || apart == 2) beside18[a] |= 1U << b;
            }
        }
    }

private:
    /// The number of axes along which two voxels differ; 9 if they are not neighbours.
    static int steps(const Coord& a, const Coord& b) {
        int axes = 0;
        for (int n = 0; n < 3; ++n) {
            const int apart = std::abs(a[n] - b[n]);
            if (apart > 1) return 9;
            axes += apart;
        }
        return axes;
    }
};

const Neighbourhood kAround;

/// The voxels that are adjacent to any voxel of the set `front`.
std::uint32_t beside(std::uint32_t front, const std::array<std::uint32_t, 26>& neighbours) {
    std::uint32_t all = 0;
    for (; front != 0; front &= front - 1) all |= neighbours[std::size_t(__builtin_ctz(front))];
    return all;
}

/// Whether the set contains voxels adjacent to the centre, which are those in `next`, and these are connected to each
/// other by voxels of the set that are at most steps - 1 neighbours away from them.
bool is_one_piece(std::uint32_t set, std::uint32_t next, const std::array<std::uint32_t, 26>& neighbours, int steps) {
    const std::uint32_t touching = set & next;
    if (touching == 0) return false;
    std::uint32_t within = touching;
    for (int n = 1; n < steps; ++n) within |= beside(within, neighbours) & set;
    std::uint32_t reached = 0;
    for (std::uint32_t front = touching & (~touching + 1); front != 0;
         front = beside(front, neighbours) & within & ~reached)
        reached |= front;
    return (touching & ~reached) == 0;
}

/// Whether a voxel can change its sign without a change of topology.
/// @param inside  set of its 26 neighbours that are inside
bool is_simple(std::uint32_t inside) {
    return is_one_piece(inside, kAround.faces, kAround.beside6, 3) &&
           is_one_piece(~inside & 0x3FFFFFFU, kAround.faces_and_edges, kAround.beside18, 2);
}

struct Waiting {
    float depth;
    Coord at;
    bool operator<(const Waiting& other) const { return depth != other.depth ? depth < other.depth : other.at < at; }
};

/// Distance of each of the voxels from target's surface, in voxels, along paths through them (Dijkstra), because target
/// has distances only in its band.
FloatGrid::Ptr depth_of(const std::vector<Coord>& voxels, const FloatGrid& target, const RunContext& run) {
    FloatGrid::Ptr depth = FloatGrid::create(std::numeric_limits<float>::max());
    auto depth_at = depth->getAccessor();
    auto target_at = target.getConstAccessor();
    const auto h = float(target.voxelSize()[0]);
    std::priority_queue<Waiting> queue;  // with negated depths, because the queue returns the maximum first
    for (const Coord& at : voxels) {
        const float value = target_at.getValue(at);
        bool is_beside = false;
        for (std::uint32_t face = kAround.faces; face != 0; face &= face - 1)
            is_beside |= (target_at.getValue(at + kAround.offset[std::size_t(__builtin_ctz(face))]) < 0) != (value < 0);
        depth_at.setValueOn(at, is_beside ? std::abs(value) / h : std::numeric_limits<float>::max());
        if (is_beside) queue.push({-std::abs(value) / h, at});
    }
    for (std::size_t turns = 1; !queue.empty(); ++turns) {
        if (turns % kCheckEvery == 0) run.check();
        const auto [less, at] = queue.top();
        queue.pop();
        if (-less > depth_at.getValue(at)) continue;
        for (std::size_t n = 0; n < 26; ++n) {
            const Coord beside = at + kAround.offset[n];
            const float here = kAround.length[n] - less;
            if (!depth_at.isValueOn(beside) || depth_at.getValue(beside) <= here) continue;
            depth_at.setValueOn(beside, here);
            queue.push({-here, beside});
        }
    }
    return depth;
}

}  // namespace

std::size_t hold_topology(const FloatGrid& rough, FloatGrid& target, const RunContext& run, std::size_t maximum) {
    auto rough_at = rough.getConstAccessor();
    auto target_at = target.getAccessor();
    // Outside this box, signs are not reliable if a surface is cut off, as at the end of a domain.
    openvdb::CoordBBox box = target.evalActiveVoxelBoundingBox();
    box.expand(rough.evalActiveVoxelBoundingBox());
    openvdb::MaskGrid kept;  // voxels that still have rough's sign instead of target's
    auto kept_at = kept.getAccessor();
    std::vector<Coord> found;
    const auto compare = [&](const Coord& at) {
        if ((rough_at.getValue(at) < 0) == (target_at.getValue(at) < 0) || !box.isInside(at) || kept_at.isValueOn(at))
            return;
        if (found.size() % kCheckEvery == 0) run.check();
        kept_at.setValueOn(at);
        found.push_back(at);
    };
    for (auto value = target.cbeginValueOn(); value; ++value)
        if (value.isVoxelValue()) compare(value.getCoord());
    for (auto value = rough.cbeginValueOn(); value; ++value)
        if (value.isVoxelValue()) compare(value.getCoord());
    // Voxels between the two surfaces but far from both are active in neither, and are found as neighbours of others.
    for (std::size_t n = 0; n < found.size(); ++n) {
        if (found.size() > maximum) return 0;
        for (std::uint32_t face = kAround.faces; face != 0; face &= face - 1)
            compare(Coord(found[n]) + kAround.offset[std::size_t(__builtin_ctz(face))]);
    }
    // The deepest voxels change first, so that the voxels that keep rough's sign are at the narrowest places.
    const FloatGrid::Ptr depth = depth_of(found, target, run);
    auto depth_at = depth->getConstAccessor();
    std::priority_queue<Waiting> queue;
    for (const Coord& at : found) queue.push({depth_at.getValue(at), at});
    std::size_t left = found.size(), turns = 0;
    while (!queue.empty()) {
        if (++turns % kCheckEvery == 0) run.check();
        const Coord at = queue.top().at;
        queue.pop();
        if (!kept_at.isValueOn(at)) continue;
        std::uint32_t inside = 0, waiting = 0;
        for (std::size_t n = 0; n < 26; ++n) {
            const Coord beside = at + kAround.offset[n];
            const bool waits = kept_at.isValueOn(beside);
            if ((target_at.getValue(beside) < 0) != waits) inside |= 1U << n;
            if (waits) waiting |= 1U << n;
        }
        if (!is_simple(inside)) continue;
        kept_at.setValueOff(at);
        --left;
        for (; waiting != 0; waiting &= waiting - 1) {
            const Coord beside = at + kAround.offset[std::size_t(__builtin_ctz(waiting))];
            queue.push({depth_at.getValue(beside), beside});
        }
    }
    const auto small = float(kHeld * target.voxelSize()[0]);
    for (auto value = kept.cbeginValueOn(); value; ++value) {
        const Coord at = value.getCoord();
        target_at.setValue(at, target_at.getValue(at) < 0 ? small : -small);
    }
    return left;
}

}  // namespace covol::cloud
