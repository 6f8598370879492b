#pragma once
// Sums of the points' splines at the nodes of a level.
#include <tbb/parallel_for.h>

#include <cmath>

#include "cloud/poisson/grid_stack.h"
#include "cloud/poisson/spline.h"

namespace covol::cloud {

/// Adds row(spline, point, i, j), a Float4, to the four nodes in row (i, j) of the 4^3 nodes of level l around each
/// point whose spline reaches that level. The order of summation does not depend on the number of threads.
template <typename Row>
void spread_on(const GridStack& stack, const std::vector<Vec3>& points, std::size_t l, std::vector<float>& nodes,
               Row row) {
    constexpr std::size_t kSide = 12;  // nodes -1 to 9 of a block, rounded up to a multiple of 4
    const GridLevel& level = stack.levels()[l];
    for (const std::vector<std::uint32_t>& colour : level.source_colours)
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, colour.size(), 4), [&](const auto& some) {
            std::vector<float> sums(kSide * kSide * kSide);
            for (std::size_t c = some.begin(); c < some.end(); ++c) {
                const GridLevel::Source& source = level.sources[colour[c]];
                std::fill(sums.begin(), sums.end(), 0.0F);
                for (std::uint32_t at = source.begin; at < source.end; ++at) {
                    const std::uint32_t n = level.order[at];
                    std::array<double, 3> within{};
                    std::size_t first = 0;
                    for (std::size_t a = 0; a < 3; ++a) {
                        const double x = (points[n][int(a)] - stack.origin()[int(a)]) / level.cell;
                        const double low = std::floor(x);
                        within[a] = x - low;
                        first = first * kSide + std::size_t(std::int32_t(low) & 7);
                    }
                    const Spline b(within);
                    for (std::size_t i = 0; i < 4; ++i)
                        for (std::size_t j = 0; j < 4; ++j) {
                            float* p = sums.data() + first + (i * kSide + j) * kSide;
                            const Float4 sum = load4(p) + row(b, n, i, j);
                            std::memcpy(p, &sum, sizeof sum);
                        }
                }
                for (int i = -1; i < 10; ++i)
                    for (int j = -1; j < 10; ++j)
                        for (int k = -1; k < 10; ++k) {
                            const float sum =
                                sums[(std::size_t(i + 1) * kSide + std::size_t(j + 1)) * kSide + std::size_t(k + 1)];
                            if (sum == 0) continue;
                            const std::uint32_t block =
                                source.targets[std::size_t(((i >> 3) + 1) * 9 + ((j >> 3) + 1) * 3 + (k >> 3) + 1)];
                            if (block != kNoBlock)
                                nodes[block * kBlockNodes + std::size_t((i & 7) * 64 + (j & 7) * 8 + (k & 7))] += sum;
                        }
            }
        });
}

}  // namespace covol::cloud
