#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "cloud/poisson/grid_stack.h"
#include "cloud/poisson/spline.h"
#include "cloud/poisson/spread.h"

namespace covol::cloud {
namespace {

/// The values of the 4^3 nodes around a position, the position within their middle cell (0 to 1 along each axis), and
/// the cell size.
struct Surrounding {
    float nodes[64];
    std::array<double, 3> within;
    double cell;
};

constexpr float kZeros[4] = {};

/// Collects the nodes around a position. @return whether all of them exist
/// @param whole  for the coarsest level: a position beyond its end is moved to the end, and missing nodes are 0
bool collect(const GridLevel& level, const float* values, const Vec3& origin, const Vec3& world, bool whole,
             Surrounding& s) {
    BlockAt at;
    std::array<std::int32_t, 3> local{};
    for (std::size_t a = 0; a < 3; ++a) {
        double x = (world[int(a)] - origin[int(a)]) / level.cell;
        if (whole) x = std::clamp(x, 0.0, double(level.blocks.back()[a] + 1) * kBlockSide - 1.000001);
        const double low = std::floor(x);
        if (!(low >= 0 && low < 2147483000.0)) return false;
        const auto node = std::int32_t(low);
        s.within[a] = x - low;
        at[a] = node >> 3, local[a] = node & 7;
    }
    const std::uint32_t block = level.find(at);
    if (block == kNoBlock) return false;
    s.cell = level.cell;
    const auto inner = [&](std::size_t a) { return local[a] >= 1 && local[a] <= 5; };
    if (inner(0) && inner(1) && inner(2)) {
        const float* p = values + block * kBlockNodes + (local[0] - 1) * 64 + (local[1] - 1) * 8 + local[2] - 1;
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) std::memcpy(s.nodes + i * 16 + j * 4, p + i * 64 + j * 8, 16);
        return true;
    }
    float* to = s.nodes;
    for (int x = local[0] - 1; x < local[0] + 3; ++x)
        for (int y = local[1] - 1; y < local[1] + 3; ++y)
            for (int z = local[2] - 1, run = 0; z < local[2] + 3; z += run, to += run) {
                run = std::min(8 - (z & 7), local[2] + 3 - z);  // up to the end of the block
                const std::uint32_t b =
                    level.beside[block][std::size_t(((x >> 3) + 1) * 9 + ((y >> 3) + 1) * 3 + (z >> 3) + 1)];
                if (b == kNoBlock && !whole) return false;
                const float* from =
                    b == kNoBlock ? kZeros : values + b * kBlockNodes + (x & 7) * 64 + (y & 7) * 8 + (z & 7);
                for (int n = 0; n < run; ++n) to[n] = from[n];
            }
    return true;
}

void collect(const StackField& field, const Vec3& world, Surrounding& s) {
    const std::vector<GridLevel>& levels = field.stack().levels();
    for (std::size_t l = 0; l + 1 < levels.size(); ++l)
        if (collect(levels[l], field.values[l].data(), field.stack().origin(), world, false, s)) return;
    collect(levels.back(), field.values.back().data(), field.stack().origin(), world, true, s);
}

}  // namespace

StackField::StackField(std::shared_ptr<const GridStack> stack) : stack_(std::move(stack)) {
    for (const GridLevel& level : stack_->levels()) values.emplace_back(level.blocks.size() * kBlockNodes, 0.0F);
}

double StackField::value_at(const Vec3& world) const {
    Surrounding s;
    collect(*this, world, s);
    const Spline b(s.within);
    Float4 sum{};
    for (std::size_t i = 0; i < 4; ++i) {
        const float* row = s.nodes + 16 * i;
        sum += b.w[0][i] * (b.w[1][0] * load4(row) + b.w[1][1] * load4(row + 4) + b.w[1][2] * load4(row + 8) +
                            b.w[1][3] * load4(row + 12));
    }
    return sum_of(sum * b.w[2]);
}

StackField::Sample StackField::at(const Vec3& world) const {
    Surrounding s;
    collect(*this, world, s);
    const Spline b(s.within);
    Float4 sum{}, along_i{}, along_j{};
    for (std::size_t i = 0; i < 4; ++i) {
        Float4 here{}, slope{};
        for (std::size_t j = 0; j < 4; ++j) {
            const Float4 v = load4(s.nodes + 16 * i + 4 * j);
            here += b.w[1][j] * v;
            slope += b.d[1][j] * v;
        }
        sum += b.w[0][i] * here;
        along_i += b.d[0][i] * here;
        along_j += b.w[0][i] * slope;
    }
    return {sum_of(sum * b.w[2]),
            {sum_of(along_i * b.w[2]) / s.cell, sum_of(along_j * b.w[2]) / s.cell, sum_of(sum * b.d[2]) / s.cell},
            s.cell};
}

StackField spread(std::shared_ptr<const GridStack> stack, const std::vector<Vec3>& points,
                  const std::vector<double>& values) {
    StackField sum(std::move(stack));
    for (std::size_t l = 0; l < sum.values.size(); ++l)
        spread_on(sum.stack(), points, l, sum.values[l],
                  [&](const Spline& b, std::size_t n, std::size_t i, std::size_t j) {
                      return float(values[n]) * b.w[0][i] * b.w[1][j] * b.w[2];
                  });
    return sum;
}

}  // namespace covol::cloud
