#pragma once
#include <openvdb/openvdb.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "clip/clipped.h"
#include "covol/domain.h"
#include "covol/error.h"
#include "covol/mesh.h"
#include "covol/run.h"
#include "grid/cube_cases.h"
#include "grid/leaf_band.h"

// Marching cubes (Lorensen and Cline 1987) over the leaves of a sparse grid, with the loops of grid/cube_cases.h. The
// signs of the 64 voxels of a slice of a leaf are stored in one word, so that cut edges and cut cubes are found 64 at a
// time.
namespace covol::detail {

// Minimum distance of vertices from the ends of a voxel's edge, as a fraction of the edge: prevents degenerate
// triangles and needles.
inline constexpr double kEdgeMargin = 0.01;
// Distance, as a fraction of a voxel's edge, of vertices on one face of a clip from another face that meets it: the
// edge between the faces becomes a narrow chamfer.
inline constexpr double kChamfer = 0.5 * kEdgeMargin;

/// A leaf of the grid, or 8^3 voxels of a tile that are adjacent to the surface.
struct Block {
    Coord origin;
    const float* values = nullptr;  ///< null: all values are `tile`
    float tile = 0;
    LeafMask inside{};
    std::array<std::uint32_t, 8> next{};   ///< block at origin + 8 (dx,dy,dz), slot 4 dx + 2 dy + dz
    std::array<LeafMask, 3> cut{};         ///< voxels whose edge along each axis is cut by the surface
    std::array<std::uint16_t, 24> rank{};  ///< number of cut edges before word w of axis a, slot 8 a + w
    std::uint32_t vertex_count = 0, triangle_count = 0;
    std::uint64_t first_vertex = 0, first_triangle = 0;

    [[nodiscard]] float value(int offset) const { return values != nullptr ? values[offset] : tile; }
};

/// Signs of 64 cubes (a slice of a leaf) at their eight corners.
using CornerWords = std::array<std::uint64_t, 8>;

inline constexpr std::uint64_t kColumnZ0 = 0x0101010101010101;
inline std::uint64_t shift_y(std::uint64_t word, std::uint64_t next) { return word >> 8 | next << 56; }
inline std::uint64_t shift_z(std::uint64_t word, std::uint64_t next) {
    return (word >> 1 & ~(kColumnZ0 << 7)) | (next & kColumnZ0) << 7;
}

/// A part of a mesh.
struct MeshPiece {
    std::uint64_t first = 0;                              ///< number of the first vertex in `positions`
    std::vector<std::array<float, 3>> positions;          ///< of the vertices used by these or later triangles
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< with vertex numbers of the whole mesh
    std::uint64_t done = 0;  ///< vertices below this number are not used by later triangles
};

class MarchingCubes {
public:
    /// @param clip  positions of the faces at which the solid is cut off.
    MarchingCubes(const FloatGrid& grid, const LatticeClip& clip, double isovalue, const RunContext& run)
        : grid_(grid), clip_(clip), domain_(domain_of(grid)), isovalue_(float(isovalue)), run_(run) {
        origin_ = choose_mesh_origin(domain_.world_box(), domain_.voxel_size);
        for (int a = 0; a < 3; ++a) domain_.origin[a] -= origin_[a];
        if (!(grid.background() >= isovalue_))
            throw Error(Errc::InvalidInput,
                        "grid '" + grid.getName() + "': expected a background of at least the isovalue, " +
                            std::to_string(isovalue_) + ", got " + std::to_string(grid.background()) +
                            "; the surface would not be closed");
    }

    [[nodiscard]] const Vec3& origin() const { return origin_; }

    /// The whole mesh.
    TriangleMesh extract() {
        prepare();
        TriangleMesh mesh;
        mesh.origin = origin_;
        mesh.vertices.resize(vertices_);
        mesh.triangles.resize(triangles_);
        tbb::parallel_for(std::size_t(0), block_count_, [&](std::size_t b) {
            place_vertices(blocks_[b], mesh.vertices.data() + blocks_[b].first_vertex);
        });
        check_numbers();
        run_.report("mesh", 0.7);
        run_.check();
        tbb::parallel_for(std::size_t(0), block_count_, [&](std::size_t b) {
            connect(blocks_[b], {mesh.vertices.data(), 0}, mesh.triangles.data() + blocks_[b].first_triangle);
        });
        run_.report("mesh", 1.0);
        return mesh;
    }

    /// Computes the vertices and triangles of extract(), in the same order, in pieces. The vertices of a block's
    /// triangles belong to the block itself or to later blocks, up to the next layer along x; only their positions are
    /// held in memory.
    /// @param begin  called with the numbers of vertices and triangles. Positions are relative to origin().
    /// @param take   called with each piece
    template <typename Begin, typename Take>
    void stream(const Begin& begin, const Take& take) {
        prepare();
        begin(vertices_, triangles_);
        constexpr std::size_t kBlocks = 1U << 13;
        MeshPiece piece;
        std::size_t placed = 0;
        for (std::size_t first = 0; first < block_count_; first += kBlocks) {
            run_.check();
            run_.report("mesh", double(first) / double(block_count_));
            const std::size_t last = std::min(first + kBlocks, block_count_);
            std::size_t reach = std::max(placed, last);
            for (std::size_t b = first; b < last; ++b)
                for (const std::uint32_t other : blocks_[b].next)
                    if (other < block_count_) reach = std::max(reach, std::size_t(other) + 1);
            piece.positions.resize(first_vertex(reach) - piece.first);
            tbb::parallel_for(placed, reach, [&](std::size_t b) {
                place_vertices(blocks_[b], piece.positions.data() + (blocks_[b].first_vertex - piece.first));
            });
            placed = reach;
            check_numbers();
            const std::uint64_t before = blocks_[first].first_triangle;
            piece.triangles.resize((last < block_count_ ? blocks_[last].first_triangle : triangles_) - before);
            tbb::parallel_for(first, last, [&](std::size_t b) {
                connect(blocks_[b], {piece.positions.data(), piece.first},
                        piece.triangles.data() + (blocks_[b].first_triangle - before));
            });
            piece.done = first_vertex(last);
            take(piece);
            piece.positions.erase(piece.positions.begin(),
                                  piece.positions.begin() + std::ptrdiff_t(piece.done - piece.first));
            piece.first = piece.done;
        }
        run_.report("mesh", 1.0);
    }

private:
    /// The positions of the vertices from number `first` on.
    struct Positions {
        const std::array<float, 3>* data;
        std::uint64_t first;
        const std::array<float, 3>& operator[](std::uint32_t vertex) const { return data[vertex - first]; }
    };

    using Tree = FloatGrid::TreeType;
    using Accessor = FloatGrid::ConstUnsafeAccessor;

    [[nodiscard]] bool is_inside(float value) const { return value < isovalue_; }

    /// Collects the leaves, and blocks of tiles whose sign differs from a neighbour's, sorted by origin.
    void collect_blocks() {
        std::vector<const Tree::LeafNodeType*> leaves;
        grid_.tree().getNodes(leaves);
        blocks_.resize(leaves.size());
        tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t i) {
            Block& block = blocks_[i];
            block.origin = leaves[i]->origin();
            block.values = leaves[i]->buffer().data();
            for (int n = 0; n < kLeafSize; n += 64) {
                std::uint64_t word = 0;
                for (int bit = 0; bit < 64; ++bit) word |= std::uint64_t(is_inside(block.values[n + bit])) << bit;
                block.inside[n / 64] = word;
            }
        });
        // Level sets with a complete narrow band need no tiles; tiles keep the surface closed for all other input.
        std::vector<Coord> needed = opposite_tiles();
        for (std::size_t checked = 0;;) {
            const std::size_t end = blocks_.size();
            append_missing_neighbours(checked, end, needed);
            checked = end;
            tbb::parallel_sort(needed.begin(), needed.end());
            needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
            std::erase_if(needed, [&](const Coord& o) { return std::binary_search(tiles_.begin(), tiles_.end(), o); });
            if (needed.empty()) break;
            for (const Coord& origin : needed) blocks_.push_back(tile_block(origin));
            tiles_.insert(tiles_.end(), needed.begin(), needed.end());
            std::sort(tiles_.begin(), tiles_.end());
            needed.clear();
            run_.check();
        }
        tbb::parallel_sort(blocks_.begin(), blocks_.end(),
                           [](const Block& a, const Block& b) { return a.origin < b.origin; });
        block_count_ = blocks_.size();
        // Two more blocks represent the space outside and the space inside that are not near the surface.
        blocks_.resize(block_count_ + 2);
        blocks_.back().inside.fill(~std::uint64_t(0));
        if (blocks_.size() > std::numeric_limits<std::uint32_t>::max())
            throw Error(Errc::Unsupported, "the grid has more than 2^32 leaves");
    }

    [[nodiscard]] Block tile_block(const Coord& origin) const {
        Block block;
        block.origin = origin;
        block.tile = grid_.tree().getValue(origin);
        block.inside.fill(is_inside(block.tile) ? ~std::uint64_t(0) : 0);
        return block;
    }

    /// Origins of 8^3 blocks of outside tiles that share a face with an inside tile.
    [[nodiscard]] std::vector<Coord> opposite_tiles() const {
        std::vector<Coord> found;
        Accessor accessor(grid_.tree());
        auto tile = grid_.tree().cbeginValueAll();
        for (tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1); tile; ++tile) {
            if (!is_inside(tile.getValue())) continue;
            openvdb::CoordBBox box;
            tile.getBoundingBox(box);
            for (int axis = 0; axis < 3; ++axis)
                for (const bool above : {false, true}) {
                    openvdb::CoordBBox rim = box;
                    rim.min()[axis] = rim.max()[axis] = above ? box.max()[axis] + 1 : box.min()[axis] - kLeafDim;
                    for (int i = rim.min()[0]; i <= rim.max()[0]; i += kLeafDim)
                        for (int j = rim.min()[1]; j <= rim.max()[1]; j += kLeafDim)
                            for (int k = rim.min()[2]; k <= rim.max()[2]; k += kLeafDim) {
                                const Coord origin(i, j, k);
                                if (accessor.probeConstLeaf(origin) == nullptr && !is_inside(accessor.getValue(origin)))
                                    found.push_back(origin);
                            }
                }
        }
        return found;
    }

    /// Appends the origins of 8^3 blocks of tiles that touch one of the blocks [begin, end) and have a sign other than
    /// one of its voxels there.
    void append_missing_neighbours(std::size_t begin, std::size_t end, std::vector<Coord>& needed) const {
        tbb::enumerable_thread_specific<std::vector<Coord>> found;
        tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 64), [&](const auto& range) {
            Accessor accessor(grid_.tree());
            auto& mine = found.local();
            for (std::size_t b = range.begin(); b < range.end(); ++b)
                for (int n = 0; n < 27; ++n) {
                    const Coord step = neighbour_step(n), origin = neighbour_origin(blocks_[b].origin, n);
                    if (n == 13 || accessor.probeConstLeaf(origin) != nullptr) continue;
                    if (rim_differs(blocks_[b].inside, step, is_inside(accessor.getValue(origin))))
                        mine.push_back(origin);
                }
        });
        for (const auto& some : found) needed.insert(needed.end(), some.begin(), some.end());
    }

    /// Whether any voxel of the block's face, edge or corner towards `step` has a sign other than `inside`.
    static bool rim_differs(const LeafMask& mask, const Coord& step, bool inside) {
        std::uint64_t facing = ~std::uint64_t(0);
        if (step.y() != 0) facing &= step.y() < 0 ? 0xff : std::uint64_t(0xff) << 56;
        if (step.z() != 0) facing &= step.z() < 0 ? kColumnZ0 : kColumnZ0 << 7;
        const int first = step.x() > 0 ? 7 : 0;
        const int last = step.x() < 0 ? 0 : 7;
        for (int x = first; x <= last; ++x)
            if ((inside ? ~mask[x] : mask[x]) & facing) return true;
        return false;
    }

    void link_blocks() {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, block_count_, 64), [&](const auto& range) {
            Accessor accessor(grid_.tree());
            for (std::size_t b = range.begin(); b < range.end(); ++b) {
                blocks_[b].next[0] = std::uint32_t(b);
                for (int slot = 1; slot < 8; ++slot)
                    blocks_[b].next[slot] = find(
                        blocks_[b].origin.offsetBy((slot >> 2) * 8, (slot >> 1 & 1) * 8, (slot & 1) * 8), b, accessor);
            }
        });
    }

    [[nodiscard]] std::uint32_t find(const Coord& origin, std::size_t after, const Accessor& accessor) const {
        const auto end = blocks_.begin() + std::ptrdiff_t(block_count_);
        const auto at = std::lower_bound(blocks_.begin() + std::ptrdiff_t(after), end, origin,
                                         [](const Block& block, const Coord& o) { return block.origin < o; });
        if (at != end && at->origin == origin) return std::uint32_t(at - blocks_.begin());
        return std::uint32_t(block_count_ + (is_inside(accessor.getValue(origin)) ? 1 : 0));
    }

    /// Corner signs of the cubes whose lowest corners are in slice x of the block.
    [[nodiscard]] CornerWords corners(const Block& block, int x) const {
        CornerWords words;
        for (int dx = 0; dx < 2; ++dx) {
            const auto slice = [&](int slot) {
                return blocks_[block.next[(x + dx > 7 ? 4 : 0) + slot]].inside[(x + dx) & 7];
            };
            const std::uint64_t along_y = shift_y(slice(0), slice(2));
            words[4 * dx] = slice(0);
            words[4 * dx + 1] = shift_z(slice(0), slice(1));
            words[4 * dx + 2] = along_y;
            words[4 * dx + 3] = shift_z(along_y, shift_y(slice(1), slice(3)));
        }
        return words;
    }

    /// Calls visit(bit, case) for each cube of a slice that the surface cuts.
    template <typename Visit>
    static void for_each_cut_cube(const CornerWords& words, const Visit& visit) {
        std::uint64_t any = 0, all = ~std::uint64_t(0);
        for (const std::uint64_t word : words) {
            any |= word;
            all &= word;
        }
        for (std::uint64_t cut = any & ~all; cut != 0; cut &= cut - 1) {
            const int bit = std::countr_zero(cut);
            unsigned inside = 0;
            for (int c = 0; c < 8; ++c) inside |= unsigned(words[c] >> bit & 1) << c;
            visit(bit, kCubeCases[inside]);
        }
    }

    void find_cuts(Block& block) {
        for (int x = 0; x < 8; ++x) {
            const CornerWords words = corners(block, x);
            for (int axis = 0; axis < 3; ++axis) block.cut[axis][x] = words[0] ^ words[axis_bit(axis)];
            for_each_cut_cube(
                words, [&](int, const CubeCase& cube) { block.triangle_count += std::uint32_t(cube.triangle_count); });
        }
        for (int axis = 0; axis < 3; ++axis)
            for (int x = 0; x < 8; ++x) {
                block.rank[8 * axis + x] = std::uint16_t(block.vertex_count);
                block.vertex_count += std::uint32_t(std::popcount(block.cut[axis][x]));
            }
    }

    void prepare() {
        collect_blocks();
        run_.report("mesh", 0.2);
        run_.check();
        link_blocks();
        tbb::parallel_for(std::size_t(0), block_count_, [&](std::size_t b) { find_cuts(blocks_[b]); });
        run_.report("mesh", 0.5);
        run_.check();
        number();
    }

    void number() {
        for (std::size_t b = 0; b < block_count_; ++b) {
            blocks_[b].first_vertex = vertices_;
            blocks_[b].first_triangle = triangles_;
            vertices_ += blocks_[b].vertex_count;
            triangles_ += blocks_[b].triangle_count;
            if (blocks_[b].vertex_count > 0) check_precision(blocks_[b]);
        }
        if (vertices_ > std::numeric_limits<std::uint32_t>::max())
            throw Error(Errc::Unsupported, "the surface has " + std::to_string(vertices_) +
                                               " vertices, more than 2^32; use a larger voxel size");
    }

    [[nodiscard]] std::uint64_t first_vertex(std::size_t block) const {
        return block < block_count_ ? blocks_[block].first_vertex : vertices_;
    }

    void check_numbers() const {
        if (not_a_number_)
            throw Error(Errc::InvalidInput,
                        "grid '" + grid_.getName() + "': a value next to the surface is not finite");
    }

    /// Throws an error unless a voxel is much wider than the resolution of the mesh's single-precision coordinates.
    void check_precision(const Block& block) const {
        const Vec3 p =
            domain_.index_to_world({double(block.origin.x()), double(block.origin.y()), double(block.origin.z())});
        for (const double c : p)
            if (domain_.voxel_size < 16 * std::abs(c) * std::numeric_limits<float>::epsilon())
                throw Error(Errc::Unsupported,
                            "near " + std::to_string(c) +
                                ", single-precision coordinates are too coarse for a voxel size of " +
                                std::to_string(domain_.voxel_size) + "; process the data in parts");
    }

    void place_vertices(const Block& block, std::array<float, 3>* out) {
        for (int axis = 0; axis < 3; ++axis)
            for (int x = 0; x < 8; ++x)
                for (std::uint64_t cut = block.cut[axis][x]; cut != 0; cut &= cut - 1)
                    *out++ = place_vertex(block, axis, x * 64 + std::countr_zero(cut));
    }

    std::array<float, 3> place_vertex(const Block& block, int axis, int offset) {
        const std::array<int, 3> local{offset >> 6, offset >> 3 & 7, offset & 7};
        const int stride = 64 >> (3 * axis);
        const bool last = local[axis] == 7;
        const double a = block.value(offset);
        const double b =
            last ? blocks_[block.next[axis_bit(axis)]].value(offset - 7 * stride) : block.value(offset + stride);
        const double t = (isovalue_ - a) / (b - a);
        if (!(t >= 0 && t <= 1)) not_a_number_ = true;
        std::array<float, 3> position{};
        const Coord voxel = block.origin.offsetBy(local[0], local[1], local[2]);
        const double from = clip_.position(axis, voxel[axis]), to = clip_.position(axis, voxel[axis] + 1);
        const bool on_cap = from == to;  // both ends of the edge are moved onto a face
        for (int c = 0; c < 3; ++c)
            position[c] = to_world(c, clip_.position(c, voxel[c]) + (on_cap && c != axis ? chamfer(c, voxel[c]) : 0.0));
        if (on_cap) return position;
        const float next = to_world(axis, to);
        const float exact = to_world(axis, from + (to - from) * std::clamp(t, kEdgeMargin, 1 - kEdgeMargin));
        // The vertex remains strictly inside its edge even after rounding.
        position[axis] = std::clamp(exact, std::nextafter(position[axis], next), std::nextafter(next, position[axis]));
        return position;
    }

    /// Distance, in index space, by which a vertex on one face of the clip is moved along `axis` away from another
    /// face. It is 0 unless the vertex's layer along `axis` lies on that other face.
    [[nodiscard]] double chamfer(int axis, int layer) const {
        if (!clip_.on_face(axis, layer)) return 0;
        const bool upper = clip_.position(axis, layer) == clip_.high[axis];
        const double inner = clip_.position(axis, clip_.face_layer(axis, upper) + (upper ? -1 : 1));
        return kChamfer * (inner - clip_.position(axis, layer));
    }

    [[nodiscard]] float to_world(int axis, double index) const {
        return float(domain_.origin[axis] + domain_.voxel_size * index);
    }

    void connect(const Block& block, const Positions& positions, std::array<std::uint32_t, 3>* out) const {
        for (int x = 0; x < 8; ++x)
            for_each_cut_cube(corners(block, x), [&](int bit, const CubeCase& cube) {
                for (int l = 0; l < cube.loop_count; ++l) {
                    const CubeLoop& loop = cube.loops[l];
                    std::array<std::uint32_t, 12> ring{};
                    for (int i = 0; i < loop.size; ++i) ring[i] = vertex_of(block, x, bit, loop.edges[i]);
                    const int apex = best_apex(loop, ring, positions);
                    for (int step = 1; step + 1 < loop.size; ++step)
                        *out++ = {ring[apex], ring[(apex + step) % loop.size], ring[(apex + step + 1) % loop.size]};
                }
            });
    }

    [[nodiscard]] std::uint32_t vertex_of(const Block& block, int x, int bit, int edge) const {
        const int corner = kEdgeStart[edge];
        const int i = x + (corner >> 2);
        const int j = (bit >> 3) + (corner >> 1 & 1);
        const int k = (bit & 7) + (corner & 1);
        const Block& owner = blocks_[block.next[(i >> 3) * 4 + (j >> 3) * 2 + (k >> 3)]];
        const int axis = edge_axis(edge);
        const std::uint64_t before = (std::uint64_t(1) << ((j & 7) * 8 + (k & 7))) - 1;
        return std::uint32_t(owner.first_vertex + owner.rank[8 * axis + (i & 7)] +
                             unsigned(std::popcount(owner.cut[axis][i & 7] & before)));
    }

    /// The apex from which the loop is divided into triangles: of those in loop.apexes, the one with the smallest sum
    /// of squared lengths of its diagonals.
    static int best_apex(const CubeLoop& loop, const std::array<std::uint32_t, 12>& ring, const Positions& positions) {
        int best = std::countr_zero(loop.apexes);
        if (loop.size == 3) return best;
        float minimum = std::numeric_limits<float>::max();
        for (int apex = 0; apex < loop.size; ++apex) {
            if (!(loop.apexes >> apex & 1)) continue;
            float sum = 0;
            for (int step = 2; step + 1 < loop.size; ++step)
                for (int c = 0; c < 3; ++c) {
                    const float d = positions[ring[apex]][c] - positions[ring[(apex + step) % loop.size]][c];
                    sum += d * d;
                }
            if (sum < minimum) {
                minimum = sum;
                best = apex;
            }
        }
        return best;
    }

    const FloatGrid& grid_;
    const LatticeClip clip_;
    Domain domain_;  ///< relative to the mesh's origin
    Vec3 origin_{};
    const float isovalue_;
    const RunContext& run_;
    std::vector<Block> blocks_;
    std::vector<Coord> tiles_;  // origins of blocks that are not leaves, sorted
    std::size_t block_count_ = 0;
    std::uint64_t vertices_ = 0, triangles_ = 0;
    std::atomic<bool> not_a_number_ = false;
};

}  // namespace covol::detail
