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

/// One grid of the stack: its nodes have one cell size. Node (i, j, k) of a block is at index 64 i + 8 j + k.
class GridLevel {
public:
    double cell = 1;                                    ///< distance between nodes, world units
    std::vector<BlockAt> blocks;                        ///< sorted
    std::vector<std::array<std::uint32_t, 27>> beside;  ///< the 3^3 blocks around each, itself at 13, or kNoBlock
    std::vector<std::array<std::uint32_t, 8>> finer;    ///< the 8 finer blocks within each, or kNoBlock
    std::vector<std::uint32_t> coarser;                 ///< for each block, the coarser block around it
    /// For each face of each block, a running number if there is no block beyond the face, else kNoBlock.
    std::vector<std::array<std::uint32_t, 6>> ghost;
    std::size_t ghosts = 0;                             ///< number of faces without a block beyond them
    std::array<std::vector<std::uint32_t>, 2> colours;  ///< blocks with even and with odd sum of coordinates
    [[nodiscard]] std::uint32_t find(const BlockAt& at) const;

    /// Points whose splines reach nodes of this level, grouped by the block that would contain their cell. This block
    /// need not exist.
    struct Source {
        BlockAt at;
        std::uint32_t begin, end;                 ///< range in `order`
        std::array<std::uint32_t, 27> targets{};  ///< the 3^3 blocks around `at`, or kNoBlock
    };
    std::vector<Source> sources;
    /// Sources in eight groups. No two sources of a group reach the same node, so they can be processed in parallel.
    std::array<std::vector<std::uint32_t>, 8> source_colours;
    std::vector<std::uint32_t> order;  ///< indices of the points, sorted by source

    /// Sorts the blocks, removes duplicates, and computes from them `beside`, `ghost`, `ghosts`, `colours` and the
    /// table of find(). `finer` and `coarser` are set to kNoBlock.
    void index();

private:
    std::vector<std::uint32_t> table_;
};

class GridStack {
public:
    /// @param levels  for each point, the level of the finest grid around it, whose cells are cell * 2^level; empty: 0
    /// for all
    /// @param cell    cell size of the finest grid, world units
    /// @param beyond  minimum margin of the coarsest grid on each side of the points, in units of the longest
    /// side of the points' box
    GridStack(const std::vector<Vec3>& points, const std::vector<std::uint8_t>& levels, double cell, double beyond);

    [[nodiscard]] const std::vector<GridLevel>& levels() const { return levels_; }  ///< the finest first
    [[nodiscard]] const Vec3& origin() const { return origin_; }                    ///< world position of node 0
    /// The values at the border of the coarsest level are fixed to 0: at nodes whose index along any axis is 0, or is
    /// at least end() along that axis.
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
        double cell;    ///< cell size of the level that was used, world units
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
