#include "cloud/poisson/winding_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "cloud/poisson/block_kernel.h"
#include "cloud/poisson/spread.h"

namespace covol::cloud {
namespace {

constexpr int kCoarsestSweeps = 32;  // Gauss-Seidel sweeps that nearly solve the coarsest grid

template <typename Visit>
void for_blocks(std::size_t count, Visit visit) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 8), [&](const auto& some) {
        for (std::size_t n = some.begin(); n < some.end(); ++n) visit(n);
    });
}

std::size_t beside_at(int i, int j, int k) {
    return std::size_t(((i >> 3) + 1) * 9 + ((j >> 3) + 1) * 3 + (k >> 3) + 1);
}
std::size_t node_at(int i, int j, int k) { return std::size_t((i & 7) * 64 + (j & 7) * 8 + (k & 7)); }

/// Copies the values of nodes low..low+count-1 along each axis, relative to a block; 0 for nodes that do not exist.
void collect_nodes(const GridLevel& grid, const std::vector<float>& values, std::size_t block,
                   const std::array<int, 3>& low, int count, float* out) {
    for (int i = low[0]; i < low[0] + count; ++i)
        for (int j = low[1]; j < low[1] + count; ++j)
            for (int k = low[2], run = 0; k < low[2] + count; k += run, out += run) {
                run = std::min(8 - (k & 7), low[2] + count - k);  // up to the end of the block
                const std::uint32_t b = grid.beside[block][beside_at(i, j, k)];
                if (b == kNoBlock)
                    std::fill_n(out, run, 0.0F);
                else
                    std::copy_n(values.data() + b * kBlockNodes + node_at(i, j, k), run, out);
            }
}

/// The position of a block's node 0 within the block of the coarser grid that contains it.
std::array<int, 3> place_in_coarser(const BlockAt& at) { return {(at[0] & 1) * 4, (at[1] & 1) * 4, (at[2] & 1) * 4}; }

}  // namespace

WindingField::WindingField(std::shared_ptr<const GridStack> stack)
    : solution_(std::move(stack)), levels_(solution_.values.size()) {
    for (std::size_t l = 0; l < levels_.size(); ++l) {
        const std::size_t nodes = solution_.values[l].size();
        levels_[l].right.assign(nodes, 0.0F);
        if (l + 1 < levels_.size()) levels_[l].residual.assign(nodes, 0.0F);
        if (l > 0) levels_[l].before.assign(nodes, 0.0F);
        levels_[l].ghosts.assign(grid(l).ghosts * 64, 0.0F);
    }
}

const float* WindingField::screen_of(std::size_t l, std::size_t block) const {
    return levels_[l].screen.empty() ? nullptr : levels_[l].screen.data() + block * kBlockNodes;
}

/// Copies the block's solution, and one layer of values across each of its faces: those of the next block or, if there
/// is none, the ghosts.
void WindingField::pad(std::size_t l, std::size_t block, float* padded) const {
    const std::vector<float>& u = solution_.values[l];
    const float* own = u.data() + block * kBlockNodes;
    for (std::size_t i = 0; i < 8; ++i)
        for (std::size_t j = 0; j < 8; ++j)
            std::memcpy(padded + (i + 1) * 100 + (j + 1) * 10 + 1, own + i * 64 + j * 8, 8 * sizeof(float));
    // Calls copy(values across the face, distance in memory between their rows, whether these are nodes of a block).
    const auto across = [&](std::size_t face, std::size_t beside, std::size_t first, std::size_t rows, auto copy) {
        if (const std::uint32_t other = grid(l).beside[block][beside]; other != kNoBlock)
            copy(u.data() + other * kBlockNodes + first, rows, std::true_type());
        else
            copy(levels_[l].ghosts.data() + std::size_t(grid(l).ghost[block][face]) * 64, std::size_t(8),
                 std::false_type());
    };
    const auto rows_to = [](float* to, std::size_t to_rows) {
        return [=](const float* from, std::size_t rows, auto) {
            for (std::size_t m = 0; m < 8; ++m) std::memcpy(to + m * to_rows, from + m * rows, 8 * sizeof(float));
        };
    };
    across(0, 4, 7 * 64, 8, rows_to(padded + 11, 10));
    across(1, 22, 0, 8, rows_to(padded + 911, 10));
    across(2, 10, 7 * 8, 64, rows_to(padded + 101, 100));
    across(3, 16, 0, 64, rows_to(padded + 191, 100));
    const auto column_to = [](float* to) {
        return [=](const float* from, std::size_t rows, auto in_block) {
            constexpr std::size_t kStep = decltype(in_block)::value ? 8 : 1;
            for (std::size_t m = 0; m < 8; ++m)
                for (std::size_t n = 0; n < 8; ++n) to[m * 100 + n * 10] = from[m * rows + n * kStep];
        };
    };
    across(4, 12, 7, 64, column_to(padded + 110));
    across(5, 14, 0, 64, column_to(padded + 119));
}

void WindingField::sweep(std::size_t l) {
    // Blocks of one colour have no faces in common, so they can be processed in parallel.
    for (const std::vector<std::uint32_t>& colour : grid(l).colours)
        for_blocks(colour.size(), [&](std::size_t n) {
            const std::size_t block = colour[n];
            float padded[kPadded];
            pad(l, block, padded);
            sweep_block(padded, levels_[l].right.data() + block * kBlockNodes, screen_of(l, block));
            float* own = solution_.values[l].data() + block * kBlockNodes;
            for (std::size_t i = 0; i < 8; ++i)
                for (std::size_t j = 0; j < 8; ++j)
                    std::memcpy(own + i * 64 + j * 8, padded + (i + 1) * 100 + (j + 1) * 10 + 1, 8 * sizeof(float));
        });
}

void WindingField::find_residual(std::size_t l) {
    for_blocks(grid(l).blocks.size(), [&](std::size_t block) {
        float padded[kPadded];
        pad(l, block, padded);
        residual_block(padded, levels_[l].right.data() + block * kBlockNodes, screen_of(l, block),
                       levels_[l].residual.data() + block * kBlockNodes);
    });
}

/// Sets the values beyond the faces at which the grid of level l ends, by trilinear interpolation of the coarser grid.
void WindingField::set_ghosts(std::size_t l) {
    if (l + 1 == levels_.size()) return;  // the values beyond the coarsest grid are 0
    const GridLevel& fine = grid(l);
    for_blocks(fine.blocks.size(), [&](std::size_t block) {
        if (std::all_of(fine.ghost[block].begin(), fine.ghost[block].end(), [](auto g) { return g == kNoBlock; }))
            return;
        float coarse[216];
        std::array<int, 3> low = place_in_coarser(fine.blocks[block]);
        for (int& x : low) --x;
        collect_nodes(grid(l + 1), solution_.values[l + 1], fine.coarser[block], low, 6, coarse);
        constexpr std::size_t kStep[3] = {36, 6, 1};
        for (std::size_t face = 0; face < 6; ++face) {
            if (fine.ghost[block][face] == kNoBlock) continue;
            const std::size_t axis = face / 2, b = axis == 0 ? 1 : 0, c = axis == 2 ? 1 : 2;
            float* out = levels_[l].ghosts.data() + std::size_t(fine.ghost[block][face]) * 64;
            const auto node = [&](std::size_t m, std::size_t n) {
                const float* p = coarse + (m + 1) * kStep[b] + (n + 1) * kStep[c];
                return (face & 1) != 0 ? p[5 * kStep[axis]] : 0.5F * (p[0] + p[kStep[axis]]);
            };
            for (std::size_t m = 0; m < 8; ++m)
                for (std::size_t n = 0; n < 8; ++n)
                    out[m * 8 + n] = 0.25F * (node(m / 2, n / 2) + node((m + 1) / 2, n / 2) + node(m / 2, (n + 1) / 2) +
                                              node((m + 1) / 2, (n + 1) / 2));
        }
    });
}

/// Full approximation storage: sets the nodes of level l that level l - 1 covers to the solution of level l - 1, and
/// the right-hand side there such that this solution is exact if level l - 1 has no residual.
void WindingField::restrict_from(std::size_t l) {
    const GridLevel& fine = grid(l - 1);
    const GridLevel& own = grid(l);
    std::vector<float>& u = solution_.values[l];
    const auto for_covered = [&](std::size_t block, auto visit) {  // visit(finer block, its first node on level l)
        for (std::size_t child = 0; child < 8; ++child)
            if (own.finer[block][child] != kNoBlock)
                visit(own.finer[block][child],
                      block * kBlockNodes + (child & 4 ? 256U : 0U) + (child & 2 ? 32U : 0U) + (child & 1 ? 4U : 0U));
    };
    for_blocks(own.blocks.size(), [&](std::size_t block) {
        for_covered(block, [&](std::size_t child, std::size_t first) {
            float residual[729], sums[64];
            collect_nodes(fine, levels_[l - 1].residual, child, {-1, -1, -1}, 9, residual);
            restrict_block(residual, sums);
            for (std::size_t n = 0; n < 64; ++n) {
                const std::size_t i = n / 16, j = n / 4 % 4, k = n % 4, to = first + i * 64 + j * 8 + k;
                u[to] = solution_.values[l - 1][child * kBlockNodes + i * 128 + j * 16 + k * 2];
                // The equations of each level are those of the weak form, divided by the cell size. The cells of level
                // l are twice as large as those of level l - 1, so the sums are halved.
                levels_[l].right[to] = 0.5F * sums[n];
            }
        });
        std::memcpy(levels_[l].before.data() + block * kBlockNodes, u.data() + block * kBlockNodes,
                    kBlockNodes * sizeof(float));
    });
    for_blocks(own.blocks.size(), [&](std::size_t block) {
        const std::vector<float> none(kBlockNodes, 0.0F);
        float padded[kPadded], left[kBlockNodes];
        pad(l, block, padded);
        residual_block(padded, none.data(), screen_of(l, block), left);
        for_covered(block, [&](std::size_t, std::size_t first) {
            for (std::size_t n = 0; n < 64; ++n) {
                const std::size_t at = first + n / 16 * 64 + n / 4 % 4 * 8 + n % 4;
                levels_[l].right[at] -= left[at - block * kBlockNodes];
            }
        });
    });
}

/// Adds the change of level l + 1 since restrict_from() to the solution of level l.
void WindingField::correct(std::size_t l) {
    std::vector<float>& change = levels_[l + 1].before;
    tbb::parallel_for(std::size_t(0), change.size(),
                      [&](std::size_t n) { change[n] = solution_.values[l + 1][n] - change[n]; });
    for_blocks(grid(l).blocks.size(), [&](std::size_t block) {
        float coarse[125];
        collect_nodes(grid(l + 1), change, grid(l).coarser[block], place_in_coarser(grid(l).blocks[block]), 5, coarse);
        prolong_block(coarse, solution_.values[l].data() + block * kBlockNodes);
    });
}

void WindingField::cycle(std::size_t l) {
    set_ghosts(l);
    if (l + 1 == levels_.size()) {
        const std::array<int, 3>& end = solution_.stack().end();
        for (int n = 0; n < kCoarsestSweeps; ++n) {
            sweep(l);
            for (int at = 0; at < int(kBlockNodes); ++at) {
                const int i = at / 64, j = at / 8 % 8, k = at % 8;
                if (i == 0 || j == 0 || k == 0 || i >= end[0] || j >= end[1] || k >= end[2])
                    solution_.values[l][std::size_t(at)] = 0;
            }
        }
        return;
    }
    sweep(l);
    find_residual(l);
    restrict_from(l + 1);
    cycle(l + 1);
    correct(l);
    set_ghosts(l);
    sweep(l);
}

void WindingField::solve(const std::vector<Vec3>& points, const std::vector<Vec3>& vectors, int cycles,
                         const RunContext& run) {
    for (std::size_t l = 0; l < levels_.size(); ++l) {
        std::vector<float>& right = levels_[l].right;
        const std::vector<float>& screen = levels_[l].screen;
        if (screen.empty())
            std::fill(right.begin(), right.end(), 0.0F);
        else
            std::transform(screen.begin(), screen.end(), right.begin(), [](float s) { return 0.5F * s; });
        const double area = 1 / (grid(l).cell * grid(l).cell);
        spread_on(solution_.stack(), points, l, right,
                  [&](const Spline& b, std::size_t n, std::size_t i, std::size_t j) {
                      const float x = float(area * vectors[n][0]), y = float(area * vectors[n][1]),
                                  z = float(area * vectors[n][2]);
                      return -((x * b.d[0][i] * b.w[1][j] + y * b.w[0][i] * b.d[1][j]) * b.w[2] +
                               (z * b.w[0][i] * b.w[1][j]) * b.d[2]);
                  });
    }
    for (int n = 0; n < cycles; ++n) {
        run.check();
        cycle(0);
    }
}

void WindingField::start_from(const StackField& other) {
    const Vec3& origin = solution_.stack().origin();
    for (std::size_t l = 0; l < levels_.size(); ++l)
        for_blocks(grid(l).blocks.size(), [&](std::size_t block) {
            float* to = solution_.values[l].data() + block * kBlockNodes;
            const BlockAt& at = grid(l).blocks[block];
            for (int n = 0; n < int(kBlockNodes); ++n)
                to[n] = float(other.value_at({origin[0] + grid(l).cell * (8.0 * at[0] + n / 64),
                                              origin[1] + grid(l).cell * (8.0 * at[1] + n / 8 % 8),
                                              origin[2] + grid(l).cell * (8.0 * at[2] + n % 8)}));
        });
}

void WindingField::screen(const std::vector<Vec3>& points, const std::vector<double>& weights) {
    std::vector<std::vector<float>> spreads = spread(solution_.shared_stack(), points, weights).values;
    for (std::size_t l = 0; l < levels_.size(); ++l) {
        levels_[l].screen = std::move(spreads[l]);
        if (l == 0) continue;
        for_blocks(grid(l).blocks.size(), [&](std::size_t block) {
            for (std::size_t child = 0; child < 8; ++child) {
                const std::uint32_t finer = grid(l).finer[block][child];
                if (finer == kNoBlock) continue;
                float weight[729], sums[64];
                collect_nodes(grid(l - 1), levels_[l - 1].screen, finer, {-1, -1, -1}, 9, weight);
                restrict_block(weight, sums);
                float* to = levels_[l].screen.data() + block * kBlockNodes + (child & 4 ? 256U : 0U) +
                            (child & 2 ? 32U : 0U) + (child & 1 ? 4U : 0U);
                for (std::size_t n = 0; n < 64; ++n) to[n / 16 * 64 + n / 4 % 4 * 8 + n % 4] = 0.5F * sums[n];
            }
        });
    }
}

void WindingField::multiply(double factor) {
    for (std::vector<float>& values : solution_.values)
        for (float& value : values) value *= float(factor);
}

}  // namespace covol::cloud
