#pragma once
// A stack of grids around points, each with twice the cell size of the one before. Blocks of 8^3 nodes exist only near
// the points of a level and of finer ones, so that memory depends on the number of points, hardly on their extent or on
// variations of their density.
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "covol/domain.h"

namespace covol::cloud {

using BlockAt = std::array<std::int32_t, 3>;  ///< index of a block along each axis
constexpr int kBlockSide = 8;
constexpr std::size_t kBlockNodes = 512;
constexpr std::uint32_t kNoBlock = 0xffffffffU;

/// Nodes of one cell size. Node (i, j, k) of a block is at 64 i + 8 j + k.
class GridLevel {
public:
    double cell = 1;                                    ///< distance between nodes, world units
    std::vector<BlockAt> blocks;                        ///< sorted
    std::vector<std::array<std::uint32_t, 27>> beside;  ///< neighbours; the block itself at 13; kNoBlock: none
    std::vector<std::array<std::uint32_t, 8>> finer;    ///< its eight blocks of the finer level, or kNoBlock
    std::vector<std::uint32_t> coarser;                 ///< the block of the coarser level that contains it
    std::vector<std::array<std::uint32_t, 6>> ghost;    ///< number of each face with no block beyond it, or kNoBlock
    std::size_t ghosts = 0;                             ///< number of such faces
    std::array<std::vector<std::uint32_t>, 2> colours;  ///< blocks with even and with odd coordinate sum
    [[nodiscard]] std::uint32_t find(const BlockAt& at) const;

    /// Points whose splines reach nodes of this level, grouped by the block of their cell, which need not exist.
    struct Source {
        BlockAt at;
        std::uint32_t begin, end;                 ///< in `order`
        std::array<std::uint32_t, 27> targets{};  ///< blocks that the splines may reach
    };
    std::vector<Source> sources;
    std::array<std::vector<std::uint32_t>, 8> source_colours;  ///< no two sources of a colour reach the same node
    std::vector<std::uint32_t> order;                          ///< points, sorted by source

    /// Computes all other members from the blocks, which it sorts and makes unique.
    void index();

private:
    std::vector<std::uint32_t> table_;
};

class GridStack {
public:
    /// @param levels  for each point, the level of the finest grid around it, whose cells are cell * 2^level; empty: 0
    /// for all
    /// @param cell    cell size of the finest grid, world units
    /// @param beyond  minimum margin of the coarsest grid on each side of the points, in units of their longest side
    GridStack(const std::vector<Vec3>& points, const std::vector<std::uint8_t>& levels, double cell, double beyond);

    [[nodiscard]] const std::vector<GridLevel>& levels() const { return levels_; }  ///< the finest first
    [[nodiscard]] const Vec3& origin() const { return origin_; }                    ///< of node 0 of all levels
    /// The border of the coarsest level, where values are 0, consists of its nodes below 1 and from end() on along each
    /// axis.
    [[nodiscard]] const std::array<int, 3>& end() const { return end_; }
    [[nodiscard]] double cell() const { return levels_.front().cell; }
    [[nodiscard]] std::size_t block_count() const;
    /// Whether the next finer level has all nodes of the cell whose lowest corner is node (i, j, k) of a block.
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

/// Values at the nodes of all levels, which are coefficients of cubic B-splines. A position is evaluated on the finest
/// level of which all nodes around it exist.
class StackField {
public:
    explicit StackField(std::shared_ptr<const GridStack> stack);

    struct Sample {
        double value;
        Vec3 gradient;  ///< 1 / world unit
        double cell;    ///< of the level used
    };
    [[nodiscard]] Sample at(const Vec3& world) const;
    [[nodiscard]] double value_at(const Vec3& world) const;
    [[nodiscard]] const GridStack& stack() const { return *stack_; }
    [[nodiscard]] const std::shared_ptr<const GridStack>& shared_stack() const { return stack_; }

    std::vector<std::vector<float>> values;  ///< for each level, its blocks one after the other

private:
    std::shared_ptr<const GridStack> stack_;
};

/// The values of the points, distributed by splines to the nodes around them on the level of each point and on those
/// nodes of finer levels that exist.
/// @param points  those of the stack
[[nodiscard]] StackField spread(std::shared_ptr<const GridStack> stack, const std::vector<Vec3>& points,
                                const std::vector<double>& values);

}  // namespace covol::cloud
