#include "cloud/poisson/grid_stack.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "covol/points.h"

namespace covol::cloud {
namespace {

// [cells] Margin of each level around the nodes -1 to 2 that the spline of one of its points reaches. The same point's
// spline on the next coarser level, which is twice as wide, then ends within the finer level.
constexpr int kAround = 3;
// Maximum number of the coarsest level's cells along its longest side. Its nodes then fit into one block.
constexpr int kCoarsestCells = kBlockSide - 1;
// [cells of the coarser level] Margin that each level covers around the blocks of the next finer level.
constexpr int kGrading = 2;

std::size_t hash(const BlockAt& at) {
    std::uint64_t h = std::uint64_t(std::uint32_t(at[0])) * 0x9e3779b97f4a7c15ULL;
    h = (h ^ (h >> 29) ^ std::uint32_t(at[1])) * 0xbf58476d1ce4e5b9ULL;
    h = (h ^ (h >> 32) ^ std::uint32_t(at[2])) * 0x94d049bb133111ebULL;
    return std::size_t(h ^ (h >> 31));
}

BlockAt shifted(const BlockAt& at, int i, int j, int k) { return {at[0] + i, at[1] + j, at[2] + k}; }

}  // namespace

std::uint32_t GridLevel::find(const BlockAt& at) const {
    const std::size_t mask = table_.size() - 1;
    for (std::size_t slot = hash(at) & mask;; slot = (slot + 1) & mask)
        if (table_[slot] == kNoBlock || blocks[table_[slot]] == at) return table_[slot];
}

void GridLevel::index() {
    tbb::parallel_sort(blocks.begin(), blocks.end());
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    std::size_t slots = 16;
    while (slots < 3 * blocks.size()) slots *= 2;
    table_.assign(slots, kNoBlock);
    for (std::uint32_t n = 0; n < blocks.size(); ++n) {
        std::size_t slot = hash(blocks[n]) & (slots - 1);
        while (table_[slot] != kNoBlock) slot = (slot + 1) & (slots - 1);
        table_[slot] = n;
    }
    beside.resize(blocks.size());
    finer.resize(blocks.size());
    coarser.assign(blocks.size(), kNoBlock);
    tbb::parallel_for(std::size_t(0), blocks.size(), [&](std::size_t n) {
        for (int m = 0; m < 27; ++m)
            beside[n][std::size_t(m)] = find(shifted(blocks[n], m / 9 - 1, m / 3 % 3 - 1, m % 3 - 1));
        finer[n].fill(kNoBlock);
    });
    ghost.resize(blocks.size());
    ghosts = 0;
    constexpr std::size_t kFaces[6] = {4, 22, 10, 16, 12, 14};
    for (std::uint32_t n = 0; n < blocks.size(); ++n) {
        for (std::size_t face = 0; face < 6; ++face)
            ghost[n][face] = beside[n][kFaces[face]] == kNoBlock ? std::uint32_t(ghosts++) : kNoBlock;
        colours[std::size_t((blocks[n][0] + blocks[n][1] + blocks[n][2]) & 1)].push_back(n);
    }
}

/// The points, and for each the level of the finest grid around it.
struct GridStack::Placed {
    [[nodiscard]] std::uint8_t level_of(std::size_t n) const { return levels.empty() ? 0 : levels[n]; }
    const std::vector<Vec3>& points;
    const std::vector<std::uint8_t>& levels;
};

GridStack::GridStack(const std::vector<Vec3>& points, const std::vector<std::uint8_t>& levels, double cell,
                     double beyond) {
    const Placed placed{points, levels};
    const WorldBox box = bounding_box(points);
    const double longest = longest_side(box), whole = longest * (1 + 2 * beyond);
    std::size_t count = 1;
    double coarsest = cell;
    for (; whole / coarsest > kCoarsestCells && count < 28; ++count) coarsest *= 2;
    for (int a = 0; a < 3; ++a) {
        const double side = box.max[a] - box.min[a] + 2 * beyond * longest;
        end_[std::size_t(a)] = std::clamp(int(std::ceil(side / coarsest - 1e-9)), 2, kCoarsestCells);
        origin_[a] = 0.5 * (box.min[a] + box.max[a] - end_[std::size_t(a)] * coarsest);
    }
    levels_.resize(count);
    for (std::size_t l = 0; l < count; ++l) {
        levels_[l].cell = cell * std::ldexp(1.0, int(l));
        add_blocks(l, placed);
        levels_[l].index();
        if (l == 0) continue;
        GridLevel& fine = levels_[l - 1];
        for (std::uint32_t n = 0; n < fine.blocks.size(); ++n) {
            const BlockAt& at = fine.blocks[n];
            fine.coarser[n] = levels_[l].find({at[0] >> 1, at[1] >> 1, at[2] >> 1});
            levels_[l].finer[fine.coarser[n]][std::size_t((at[0] & 1) * 4 + (at[1] & 1) * 2 + (at[2] & 1))] = n;
        }
    }
    for (std::size_t l = 0; l < count; ++l) find_sources(l, placed);
}

std::array<std::int32_t, 3> GridStack::base(std::size_t level, const Vec3& world) const {
    std::array<std::int32_t, 3> node{};
    for (std::size_t a = 0; a < 3; ++a)
        node[a] = std::int32_t(std::floor((world[int(a)] - origin_[int(a)]) / levels_[level].cell));
    return node;
}

/// Adds blocks near the points of this level and around the blocks of the next finer level.
void GridStack::add_blocks(std::size_t level, const Placed& placed) {
    std::vector<BlockAt>& blocks = levels_[level].blocks;
    const int last = (1 << (levels_.size() - 1 - level)) - 1;  // last block along each axis
    const auto add = [&](const BlockAt& low, const BlockAt& high) {
        BlockAt from, to;
        for (std::size_t a = 0; a < 3; ++a) from[a] = std::max(0, low[a] >> 3), to[a] = std::min(last, high[a] >> 3);
        for (int i = from[0]; i <= to[0]; ++i)
            for (int j = from[1]; j <= to[1]; ++j)
                for (int k = from[2]; k <= to[2]; ++k) blocks.push_back({i, j, k});
    };
    if (level + 1 == levels_.size()) {
        add({0, 0, 0}, {0, 0, 0});
        return;
    }
    if (level > 0)
        for (const BlockAt& fine : levels_[level - 1].blocks) {
            const BlockAt first{4 * fine[0], 4 * fine[1], 4 * fine[2]};
            add(shifted(first, -kGrading, -kGrading, -kGrading),
                shifted(first, 4 + kGrading, 4 + kGrading, 4 + kGrading));
        }
    // For each point, its block and a mask with three bits for each axis: whether the point needs the block before its
    // own, its own and the block after it. Duplicates, which are frequent for neighbouring points, are removed.
    std::vector<std::pair<BlockAt, std::uint32_t>> needs;
    for (std::size_t n = 0; n < placed.points.size(); ++n) {
        if (std::min<std::size_t>(placed.level_of(n), levels_.size() - 1) != level) continue;
        const std::array<std::int32_t, 3> node = base(level, placed.points[n]);
        std::uint32_t mask = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const int in = node[a] & 7;
            mask |= (2U | (in - 1 - kAround < 0 ? 1U : 0U) | (in + 2 + kAround > 7 ? 4U : 0U)) << (3 * a);
        }
        needs.push_back({{node[0] >> 3, node[1] >> 3, node[2] >> 3}, mask});
    }
    tbb::parallel_sort(needs.begin(), needs.end());
    needs.erase(std::unique(needs.begin(), needs.end()), needs.end());
    for (const auto& [at, mask] : needs)
        for (int m = 0; m < 27; ++m) {
            const int i = m / 9, j = m / 3 % 3, k = m % 3;
            if (((mask >> i) & (mask >> (3 + j)) & (mask >> (6 + k)) & 1U) == 0) continue;
            const BlockAt first{8 * (at[0] + i - 1), 8 * (at[1] + j - 1), 8 * (at[2] + k - 1)};
            add(first, first);
        }
}

void GridStack::find_sources(std::size_t l, const Placed& given) {
    GridLevel& level = levels_[l];
    std::vector<std::pair<BlockAt, std::uint32_t>> placed(given.points.size());
    tbb::parallel_for(std::size_t(0), placed.size(), [&](std::size_t n) {
        constexpr BlockAt kNowhere{std::numeric_limits<std::int32_t>::max(), 0, 0};
        placed[n] = {kNowhere, std::uint32_t(n)};
        const std::size_t own = std::min<std::size_t>(given.level_of(n), levels_.size() - 1);
        if (own < l) return;
        const std::array<std::int32_t, 3> node = base(l, given.points[n]);
        bool reaches = own == l;
        for (int corner = 0; corner < 8 && !reaches; ++corner)
            reaches = level.find({(node[0] + (corner & 1 ? 2 : -1)) >> 3, (node[1] + (corner & 2 ? 2 : -1)) >> 3,
                                  (node[2] + (corner & 4 ? 2 : -1)) >> 3}) != kNoBlock;
        if (reaches) placed[n].first = {node[0] >> 3, node[1] >> 3, node[2] >> 3};
    });
    std::erase_if(placed, [](const auto& p) { return p.first[0] == std::numeric_limits<std::int32_t>::max(); });
    tbb::parallel_sort(placed.begin(), placed.end());
    level.order.resize(placed.size());
    for (std::uint32_t n = 0; n < placed.size(); ++n) {
        level.order[n] = placed[n].second;
        if (n == 0 || placed[n].first != placed[n - 1].first) level.sources.push_back({placed[n].first, n, n, {}});
        level.sources.back().end = n + 1;
    }
    tbb::parallel_for(std::size_t(0), level.sources.size(), [&](std::size_t n) {
        GridLevel::Source& source = level.sources[n];
        for (int m = 0; m < 27; ++m)
            source.targets[std::size_t(m)] = level.find(shifted(source.at, m / 9 - 1, m / 3 % 3 - 1, m % 3 - 1));
    });
    for (std::uint32_t n = 0; n < level.sources.size(); ++n) {
        const BlockAt& at = level.sources[n].at;
        level.source_colours[std::size_t((at[0] & 1) * 4 + (at[1] & 1) * 2 + (at[2] & 1))].push_back(n);
    }
}

bool GridStack::is_refined(std::size_t level, std::uint32_t block, int i, int j, int k) const {
    if (level == 0) return false;
    const std::uint32_t child = levels_[level].finer[block][std::size_t((i >> 2) * 4 + (j >> 2) * 2 + (k >> 2))];
    if (child == kNoBlock) return false;
    for (int corner = 1; corner < 8; ++corner) {
        const int x = (i & 3) == 3 && (corner & 4) != 0, y = (j & 3) == 3 && (corner & 2) != 0,
                  z = (k & 3) == 3 && (corner & 1) != 0;
        if (levels_[level - 1].beside[child][std::size_t((x + 1) * 9 + (y + 1) * 3 + z + 1)] == kNoBlock) return false;
    }
    return true;
}

std::size_t GridStack::block_count() const {
    std::size_t count = 0;
    for (const GridLevel& level : levels_) count += level.blocks.size();
    return count;
}

}  // namespace covol::cloud
