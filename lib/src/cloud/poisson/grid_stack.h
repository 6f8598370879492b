#pragma once
// Grids around points, each of twice the cell of the one before, in blocks of 8^3 nodes that exist only near the points
// that need them: memory goes by the number of points, whatever their extent and however uneven their density.
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "covol/domain.h"

namespace covol::cloud {

using BlockAt = std::array<std::int32_t, 3>;  ///< of its first node, in blocks
constexpr int kBlockSide = 8;
constexpr std::size_t kBlockNodes = 512;
constexpr std::uint32_t kNoBlock = 0xffffffffU;

/// Nodes of one cell size. Node (i, j, k) of a block is at 64 i + 8 j + k.
class GridLevel {
public:
    double cell = 1;                                    ///< distance of nodes, world units
    std::vector<BlockAt> blocks;                        ///< sorted
    std::vector<std::array<std::uint32_t, 27>> beside;  ///< neighbours of a block, itself is 13; kNoBlock: none
    std::vector<std::array<std::uint32_t, 8>> finer;    ///< blocks of the finer level that lie in it, or kNoBlock
    std::vector<std::uint32_t> coarser;                 ///< the block of the coarser level in which it lies
    std::vector<std::array<std::uint32_t, 6>> ghost;    ///< number of each face beyond which no block is, or kNoBlock
    std::size_t ghosts = 0;                             ///< such faces
    std::array<std::vector<std::uint32_t>, 2> colours;  ///< blocks of even and odd coordinate sum
    [[nodiscard]] std::uint32_t find(const BlockAt& at) const;

    /// Points whose splines reach nodes of this level, by the block of their cell, which need not exist.
    struct Source {
        BlockAt at;
        std::uint32_t begin, end;                 ///< in `order`
        std::array<std::uint32_t, 27> targets{};  ///< blocks that the splines may reach
    };
    std::vector<Source> sources;
    std::array<std::vector<std::uint32_t>, 8> source_colours;  ///< of one, no two reach the same node
    std::vector<std::uint32_t> order;                          ///< points

    /// Sets everything that follows from the blocks, which are sorted here and made unique.
    void index();

private:
    std::vector<std::uint32_t> table_;
};

class GridStack {
public:
    /// @param levels  of each point: on a grid of cell * 2^level its own cells end; empty: 0
    /// @param cell    of the finest grid, world units
    /// @param beyond  of the coarsest grid, at least, on each side of the points, in their longest side
    GridStack(const std::vector<Vec3>& points, const std::vector<std::uint8_t>& levels, double cell, double beyond);

    [[nodiscard]] const std::vector<GridLevel>& levels() const { return levels_; }  ///< the finest first
    [[nodiscard]] const Vec3& origin() const { return origin_; }                    ///< of node 0 of all levels
    /// The coarsest level's nodes before 1 and from here on are the border, where values are 0.
    [[nodiscard]] const std::array<int, 3>& end() const { return end_; }
    [[nodiscard]] double cell() const { return levels_.front().cell; }
    [[nodiscard]] std::size_t block_count() const;
    /// Whether the next finer level has all nodes of the cell behind a block's node.
    [[nodiscard]] bool is_refined(std::size_t level, std::uint32_t block, int i, int j, int k) const;

private:
    struct Placed;
    void add_blocks(std::size_t level, const Placed& placed);
    void find_sources(std::size_t level, const Placed& placed);
    [[nodiscard]] std::array<std::int32_t, 3> base(std::size_t level, const Vec3& world) const;

    Vec3 origin_{0, 0, 0};
    std::array<int, 3> end_{};
    std::vector<GridLevel> levels_;
};

/// Values at the nodes of all levels, the coefficients of cubic B-splines; a place has that of the finest level of
/// which all nodes around it exist.
class StackField {
public:
    explicit StackField(std::shared_ptr<const GridStack> stack);

    struct Sample {
        double value;
        Vec3 gradient;  ///< 1 / world unit
        double cell;    ///< of the level
    };
    [[nodiscard]] Sample at(const Vec3& world) const;
    [[nodiscard]] double value_at(const Vec3& world) const;
    [[nodiscard]] const GridStack& stack() const { return *stack_; }
    [[nodiscard]] const std::shared_ptr<const GridStack>& shared_stack() const { return stack_; }

    std::vector<std::vector<float>> values;  ///< of a level, its blocks one after the other

private:
    std::shared_ptr<const GridStack> stack_;
};

/// Sums of the points' values, spread over the nodes around them on the level of each point and the finer ones.
/// @param points  those of the stack
[[nodiscard]] StackField spread(std::shared_ptr<const GridStack> stack, const std::vector<Vec3>& points,
                                const std::vector<double>& values);

}  // namespace covol::cloud
