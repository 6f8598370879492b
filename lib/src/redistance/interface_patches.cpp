#include "redistance/interface_patches.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "grid/cube_cases.h"
#include "grid/sign_masks.h"

namespace covol::detail {
namespace {

using Point = std::array<float, 3>;

Point operator-(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
float dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point cross(const Point& a, const Point& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

constexpr int kSide = kLeafDim + 1;                                 ///< voxels along an edge of a leaf's cube of cells
constexpr float kOutside = std::numeric_limits<float>::infinity();  ///< marks a voxel outside the domain

constexpr int cell_voxel(int i, int j, int k) { return (i * kSide + j) * kSide + k; }
constexpr std::array<int, 8> kCornerOffset = [] {
    std::array<int, 8> offset{};
    for (int c = 0; c < 8; ++c) offset[c] = cell_voxel(c >> 2 & 1, c >> 1 & 1, c & 1);
    return offset;
}();

/// The values of u at the 9^3 corners of a leaf's cells; kOutside at corners outside the domain.
class CellValues {
public:
    CellValues(const FloatGrid& u, const Domain& domain) : accessor_(u.getConstAccessor()), domain_(box_of(domain)) {}

    /// Loads the values for the leaf at `origin`. Returns false if no cell has a crossing.
    bool load(const Coord& origin) {
        std::array<Block, 8> blocks;
        for (int block = 0; block < 8; ++block)
            blocks[block] = find_block(origin, {block >> 2 & 1, block >> 1 & 1, block & 1});
        // A quick test, because most leaves of a wide band lie on one side of the surface. Voxels beyond the domain's
        // end count as outside. A leaf that extends beyond this end may therefore have crossings even if all of its
        // values are negative.
        const openvdb::CoordBBox box(origin, origin.offsetBy(kLeafDim));
        const bool is_cut = !domain_.isInside(box), first = blocks[0].first() < 0;
        if (!(is_cut && first) &&
            std::all_of(blocks.begin(), blocks.end(), [&](const Block& block) { return block.is_all(first); }))
            return false;
        for (const Block& block : blocks) copy(block);
        if (is_cut) clip(origin);
        bool any = false, all = true;
        for (int row = 0; row < kSide * kSide; ++row) {
            const float* v = values_.data() + std::size_t(row) * kSide;
            int bits = 0;
            for (int k = 0; k < kSide; ++k) bits |= (v[k] < 0) << k;
            negative_[row] = bits;
            any |= bits != 0;
            all &= bits == (1 << kSide) - 1;
        }
        return any && !all;
    }

    /// Bit k is set if the corners of the cell (i, j, k) are not all on one side of the surface.
    [[nodiscard]] unsigned crossed(int i, int j) const {
        const int* row = negative_.data() + i * kSide + j;
        int any = row[0] | row[1] | row[kSide] | row[kSide + 1], all = row[0] & row[1] & row[kSide] & row[kSide + 1];
        any |= any >> 1;
        all &= all >> 1;
        return unsigned(any & ~all) & ((1U << kLeafDim) - 1);
    }

    /// Bit c is set if corner c of the cell is inside.
    [[nodiscard]] int signs(int i, int j, int k) const {
        const int* row = negative_.data() + i * kSide + j;
        const auto along_k = [k](int bits) { return bits >> k & 3; };
        return along_k(row[0]) | along_k(row[1]) << 2 | along_k(row[kSide]) << 4 | along_k(row[kSide + 1]) << 6;
    }

    /// Whether a corner of the cell lies outside the domain.
    [[nodiscard]] bool leaves_domain(int i, int j, int k) const {
        const float* at = values_.data() + cell_voxel(i, j, k);
        return std::any_of(kCornerOffset.begin(), kCornerOffset.end(), [at](int c) { return at[c] == kOutside; });
    }

    /// The zero crossing on edge e of the cell, in voxels from the cell's first voxel; halfway along the edge if one of
    /// its ends lies outside the domain.
    [[nodiscard]] Point crossing(int i, int j, int k, int e) const {
        const float* at = values_.data() + cell_voxel(i, j, k);
        const int a = kEdgeStart[e], b = edge_end(e);
        const float va = at[kCornerOffset[a]], vb = at[kCornerOffset[b]];
        Point point = {float(a >> 2 & 1), float(a >> 1 & 1), float(a & 1)};
        point[edge_axis(e)] = std::isinf(va) || std::isinf(vb) ? 0.5F : va / (va - vb);
        return point;
    }

private:
    /// The values that a leaf's cells need from one of eight leaves or tiles: the leaf itself and the seven next ones.
    struct Block {
        const float* buffer;  ///< null: all values are `constant`
        float constant;
        std::array<int, 3> size;
        float* to;

        [[nodiscard]] float first() const { return buffer ? buffer[0] : constant; }
        [[nodiscard]] bool is_all(bool negative) const {
            if (!buffer) return (constant < 0) == negative;
            if (size[1] == kLeafDim && size[2] == kLeafDim) {  // whole slices, which are 64-bit words of a LeafMask
                const LeafMask mask = size[0] == kLeafDim ? negative_mask(buffer) : LeafMask{negative_slice(buffer)};
                const std::uint64_t all = negative ? ~std::uint64_t(0) : 0;
                return std::all_of(mask.begin(), mask.begin() + size[0],
                                   [all](std::uint64_t word) { return word == all; });
            }
            for (int i = 0; i < size[0]; ++i)
                for (int j = 0; j < size[1]; ++j)
                    for (int k = 0; k < size[2]; ++k)
                        if ((buffer[leaf_offset(i, j, k)] < 0) != negative) return false;
            return true;
        }
    };
    [[nodiscard]] Block find_block(const Coord& origin, const std::array<int, 3>& side) {
        const Coord from = origin.offsetBy(side[0] * kLeafDim, side[1] * kLeafDim, side[2] * kLeafDim);
        const auto* leaf = accessor_.probeConstLeaf(from);
        return {leaf ? leaf->buffer().data() : nullptr,
                leaf ? 0.0F : accessor_.getValue(from),
                {side[0] ? 1 : kLeafDim, side[1] ? 1 : kLeafDim, side[2] ? 1 : kLeafDim},
                values_.data() + cell_voxel(side[0] * kLeafDim, side[1] * kLeafDim, side[2] * kLeafDim)};
    }
    static void copy(const Block& block) {
        for (int i = 0; i < block.size[0]; ++i)
            for (int j = 0; j < block.size[1]; ++j) {
                float* to = block.to + cell_voxel(i, j, 0);
                if (block.buffer)
                    std::copy_n(block.buffer + leaf_offset(i, j, 0), block.size[2], to);
                else
                    std::fill_n(to, block.size[2], block.constant);
            }
    }

    void clip(const Coord& origin) {
        for (int i = 0; i < kSide; ++i)
            for (int j = 0; j < kSide; ++j)
                for (int k = 0; k < kSide; ++k)
                    if (!domain_.isInside(origin.offsetBy(i, j, k))) values_[cell_voxel(i, j, k)] = kOutside;
    }

    FloatGrid::ConstAccessor accessor_;
    openvdb::CoordBBox domain_;
    std::array<float, kSide * kSide * kSide> values_;
    std::array<int, kSide * kSide> negative_;  // bit k of entry i * kSide + j: voxel (i, j, k) is inside
};

/// Calls visit(i, j, k, case) for the cells with a crossing, k fastest as in OpenVDB's leaves.
template <typename Visit>
void for_each_cell(const CellValues& values, DomainEnd end, const Visit& visit) {
    for (int i = 0; i < kLeafDim; ++i)
        for (int j = 0; j < kLeafDim; ++j)
            for (unsigned cells = values.crossed(i, j); cells != 0; cells &= cells - 1)
                if (const int k = __builtin_ctz(cells); end == DomainEnd::Closed || !values.leaves_domain(i, j, k))
                    visit(i, j, k, kCubeCases[values.signs(i, j, k)]);
}

Patch make_patch(const Coord& origin, const Point* points, int count, std::uint32_t first) {
    Patch patch{origin, {0, 0, 0}, {0, 0, 0}, 0, 0, first, static_cast<std::uint32_t>(count)};
    for (int n = 0; n < count; ++n)
        for (int a = 0; a < 3; ++a) patch.center[a] += points[n][a] / static_cast<float>(count);
    Point area{};
    for (int n = 0; n < count; ++n) {
        const Point c = cross(points[n] - patch.center, points[(n + 1) % count] - patch.center);
        for (int a = 0; a < 3; ++a) area[a] += c[a];
    }
    if (const float length = std::sqrt(dot(area, area)); length > 0)
        for (int a = 0; a < 3; ++a) patch.normal[a] = area[a] / length;
    for (int n = 0; n < count; ++n) {
        const Point arm = points[n] - patch.center;
        const float along = dot(arm, patch.normal);
        patch.height = std::max(patch.height, std::abs(along));
        patch.radius = std::max(patch.radius, std::sqrt(std::max(0.0F, dot(arm, arm) - along * along)));
    }
    return patch;
}

/// Adds `block` and its seven neighbours at lower indices, whose last cells have corners in `block`.
void add_with_lower_neighbours(const Coord& block, std::vector<Coord>& blocks) {
    for (int n = 0; n < 8; ++n)
        blocks.push_back(block.offsetBy(-kLeafDim * (n >> 2 & 1), -kLeafDim * (n >> 1 & 1), -kLeafDim * (n & 1)));
}

/// Adds the blocks of 8^3 voxels of inside tiles that may be adjacent to the domain's end or to an outside tile. The
/// surface may cross the cells between these although there is no leaf.
void add_tile_blocks(const FloatGrid& u, const openvdb::CoordBBox& domain, std::vector<Coord>& blocks) {
    const auto accessor = u.getConstAccessor();
    const auto meets_outside = [&](const Coord& block) {
        openvdb::CoordBBox box(block, block.offsetBy(kLeafDim - 1));
        box.expand(1);
        if (!domain.isInside(box)) return true;
        for (int axis = 0; axis < 3; ++axis)
            for (int sign = -1; sign <= 1; sign += 2) {
                Coord next = block;
                next[axis] += sign * kLeafDim;
                if (!accessor.probeConstLeaf(next) && accessor.getValue(next) >= 0) return true;
            }
        return false;
    };
    auto tile = u.tree().cbeginValueAll();
    tile.setMaxDepth(FloatGrid::TreeType::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) {
        if (!(*tile < 0)) continue;
        openvdb::CoordBBox box;
        tile.getBoundingBox(box);
        box.intersect(domain);
        if (box.empty()) continue;
        const Coord lo = box.min() & ~(kLeafDim - 1), hi = box.max() & ~(kLeafDim - 1);
        for (int i = lo[0]; i <= hi[0]; i += kLeafDim)
            for (int j = lo[1]; j <= hi[1]; j += kLeafDim) {
                const bool shell = i == lo[0] || i == hi[0] || j == lo[1] || j == hi[1];
                const int step = shell ? kLeafDim : std::max(hi[2] - lo[2], int(kLeafDim));
                for (int k = lo[2]; k <= hi[2]; k += step)
                    if (meets_outside(Coord(i, j, k))) add_with_lower_neighbours(Coord(i, j, k), blocks);
            }
    }
}

/// Leaves that may have cells with a crossing, sorted.
std::vector<Coord> candidates(const FloatGrid& u, const Domain& domain) {
    const openvdb::CoordBBox box = box_of(domain);
    std::vector<Coord> result;
    for (auto leaf = u.tree().cbeginLeaf(); leaf; ++leaf)
        if (openvdb::CoordBBox(leaf->origin(), leaf->origin().offsetBy(kLeafDim - 1)).hasOverlap(box))
            add_with_lower_neighbours(leaf->origin(), result);
    add_tile_blocks(u, box, result);
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
}

}  // namespace

PatchHit InterfacePatches::nearest(const Coord& at, const Patch& patch, float bound) const {
    const Point p = {float(at[0] - patch.origin[0]), float(at[1] - patch.origin[1]), float(at[2] - patch.origin[2])};
    const Point arm = p - patch.center;
    // The patch lies in the cylinder of its height and radius: if the squared distance of the cylinder is not below
    // `bound`, neither is that of the patch.
    const float along = dot(arm, patch.normal);
    const float beyond = std::max(0.0F, std::abs(along) - patch.height);
    const float beside = std::max(0.0F, std::sqrt(std::max(0.0F, dot(arm, arm) - along * along)) - patch.radius);
    const PatchHit none{std::numeric_limits<float>::infinity(), false};
    if (beyond * beyond + beside * beside >= bound) return none;
    const PatchHit hit = nearest_on(PatchFan(outline(patch)), arm.data());
    return hit.squared < bound ? hit : none;
}

InterfacePatches find_interface(const FloatGrid& u, const Domain& domain, DomainEnd end, const RunContext& run) {
    run.check();
    const std::vector<Coord> leaves = candidates(u, domain);
    struct Counts {
        std::uint32_t patches = 0, vertices = 0;
    };
    std::vector<Counts> counts(leaves.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16), [&](const auto& range) {
        CellValues values(u, domain);
        for (std::size_t n = range.begin(); n != range.end(); ++n)
            if (values.load(leaves[n]))
                for_each_cell(values, end, [&](int, int, int, const CubeCase& cell) {
                    counts[n].patches += cell.loop_count;
                    counts[n].vertices += cell.triangle_count + 2 * cell.loop_count;
                });
    });
    run.check();

    InterfacePatches result;
    std::vector<Counts> begins;
    Counts total;
    for (std::size_t n = 0; n < leaves.size(); ++n) {
        if (counts[n].patches == 0) continue;
        result.leaves.push_back(leaves[n]);
        result.first.push_back(total.patches);
        begins.push_back(total);
        total.patches += counts[n].patches;
        total.vertices += counts[n].vertices;
    }
    result.first.push_back(total.patches);
    result.patches.resize(total.patches);
    result.vertices.resize(total.vertices);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, result.leaves.size(), 16), [&](const auto& range) {
        CellValues values(u, domain);
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            values.load(result.leaves[n]);
            Counts next = begins[n];
            for_each_cell(values, end, [&](int i, int j, int k, const CubeCase& cell) {
                for (int l = 0; l < cell.loop_count; ++l) {
                    const CubeLoop& loop = cell.loops[l];
                    Point* points = result.vertices.data() + next.vertices;
                    for (int m = 0; m < loop.size; ++m) points[m] = values.crossing(i, j, k, loop.edges[m]);
                    result.patches[next.patches++] =
                        make_patch(result.leaves[n].offsetBy(i, j, k), points, loop.size, next.vertices);
                    next.vertices += loop.size;
                }
            });
        }
    });
    return result;
}

}  // namespace covol::detail
