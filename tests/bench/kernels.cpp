// Times of the solver's kernels on leaves, for every instruction set of this processor: on 8 leaves, which fit into the
// cache, and on 24^3 leaves (7 million voxels), which do not. The copying of leaves into padded buffers, as in a time
// step, is included. Names of benchmarks are kernel/set/where/threads.
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <array>
#include <cmath>
#include <string>

#include "counters.h"
#include "evolve/motion.h"
#include "grid/halo.h"
#include "grid/leaf_band.h"
#include "scheme/scheme.h"
#include "stream.h"

namespace covol::bench {
namespace {

using namespace covol::detail;
using Leaves = LeafArray<float>;

constexpr int kSmallSide = 2, kLargeSide = 24;  // leaves along each axis
constexpr unsigned long long kAll = ~0ULL;
constexpr std::array<unsigned long long, 8> kEveryVoxel = {kAll, kAll, kAll, kAll, kAll, kAll, kAll, kAll};

/// A cube of leaves with all fields that a time step needs; u is a distance with ripples.
struct Cube {
    LeafBand band;
    HaloField u, phi, edge;
    Leaves previous, out;
    LeafArray<Fraction> rows;

    explicit Cube(int side) {
        std::vector<Coord> origins;
        for (int i = 0; i < side; ++i)
            for (int j = 0; j < side; ++j)
                for (int k = 0; k < side; ++k) origins.emplace_back(8 * i, 8 * j, 8 * k);
        band = LeafBand(origins);
        const double middle = 4.0 * side;
        const auto radius = [=](const Coord& x) {
            return std::sqrt((x.x() - middle) * (x.x() - middle) + (x.y() - middle) * (x.y() - middle) +
                             (x.z() - middle) * (x.z() - middle));
        };
        u = field([=](const Coord& x) { return radius(x) - 0.7 * middle + 0.3 * std::sin(0.9 * x.x() + 0.7 * x.y()); });
        phi = field([=](const Coord& x) { return std::abs(radius(x) - 0.6 * middle); });
        edge = field([](const Coord& x) { return 0.5 + 0.4 * std::sin(0.3 * (x.x() + x.y() - x.z())); });
        previous = u.values;
        rows = LeafArray<Fraction>(6 * band.size(), Fraction(kFractionUnit / 10), 0);
        out = Leaves(band.size(), 0.0F, 0);
    }

    template <typename Value>
    HaloField field(Value value) const {
        HaloField f{Leaves(band.size(), 0.0F, 1), {}};
        f.blocks.resize(band.size());
        tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
            f.blocks[leaf] = band.neighbours(leaf);
            for (int n = 0; n < kLeafSize; ++n)
                f.values.leaf(leaf)[n] =
                    static_cast<float>(value(band.origin(leaf).offsetBy(n >> 6, n >> 3 & 7, n & 7)));
        });
        return f;
    }
    [[nodiscard]] Fraction* rows_of(std::size_t leaf) { return rows.leaf(6 * leaf); }
};

/// Each cube is created once and used by all kernels, because their times do not depend on the values in it.
Cube& cube_of(int side) {
    static Cube small(kSmallSide), large(kLargeSide);
    return side == kSmallSide ? small : large;
}

SchemeConstants constants() {
    SchemeConstants c{};
    c.tau = c.theta = c.rho = 1;
    c.curvature = 5;  // tau delta / h^2 for delta = 5 h and tau = h
    c.epsilon2 = 1e-4F;
    c.edge_epsilon2 = 4e-4F;
    return c;
}

void assemble(const SchemeKernels& kernels, Cube& cube, std::size_t leaf) {
    alignas(64) float u[kPaddedSize], phi[kPaddedSize], edge[kPaddedSize];
    std::copy_n(cube.u.values.leaf(leaf), kLeafSize, cube.previous.leaf(leaf));
    load_padded(cube.u, leaf, u);
    load_star(cube.phi, leaf, phi);
    load_star(cube.edge, leaf, edge);
    benchmark::DoNotOptimize(
        kernels.assemble(u, phi, edge, nullptr, kEveryVoxel.data(), constants(), cube.rows_of(leaf)));
}

template <int inner>
void relax(const SchemeKernels& kernels, Cube& cube, std::size_t leaf) {
    // relax() returns the residual; without DoNotOptimize the compiler could omit its computation.
    benchmark::DoNotOptimize(kernels.relax(star_of(cube.u, leaf), cube.previous.leaf(leaf), cube.rows_of(leaf),
                                           kEveryVoxel.data(), 1.5F, inner, {}));
}

void mean_step(const SchemeKernels& kernels, Cube& cube, std::size_t leaf) {
    kernels.mean_step(star_of(cube.u, leaf), cube.u.values.leaf(leaf), 0.5F, 1.0F / 3, cube.previous.leaf(leaf));
}

void mean_gradient(const SchemeKernels& kernels, Cube& cube, std::size_t leaf) {
    alignas(64) float u[kPaddedSize];
    load_padded(cube.u, leaf, u);
    kernels.mean_gradient(u, cube.out.leaf(leaf));
}

void motion(const SchemeKernels&, Cube& cube, std::size_t leaf) {
    benchmark::DoNotOptimize(motion_of(cube.u.values.leaf(leaf), cube.previous.leaf(leaf), true));
}

struct Kernel {
    const char* name;
    void (*run)(const SchemeKernels&, Cube&, std::size_t leaf);
    double bytes;  // bytes per voxel that are read or written, if each value is moved once
};

constexpr double kFloat = sizeof(float), kRows = 6 * sizeof(Fraction);
constexpr Kernel kKernels[] = {
    {"assemble", assemble, 3 * kFloat + kFloat + kRows},  // read u, phi, edge; write the previous u, rows
    {"relax_1", relax<1>, 2 * kFloat + kRows + kFloat},   // read u, the previous u, rows; write u
    {"relax_2", relax<2>, 2 * kFloat + kRows + kFloat},  {"mean_step", mean_step, 3 * kFloat},
    {"mean_gradient", mean_gradient, 2 * kFloat},        {"motion", motion, 2 * kFloat},
};

/// With several threads, first the even leaves and then the odd ones are visited, as in a time step, so that no leaf
/// reads values that another thread writes at the same time.
void run_on(benchmark::State& state, const Kernel& kernel, const SchemeKernels& set, int side, int threads) {
    Cube& cube = cube_of(side);
    tbb::task_arena arena(threads);
    const auto visit = [&](std::size_t leaf) { kernel.run(set, cube, leaf); };
    const std::size_t odd = cube.band.odd_begin(), end = cube.band.size();
    for (auto _ : state) {
        if (threads == 1) {
            for (std::size_t leaf = 0; leaf < end; ++leaf) visit(leaf);
        } else {
            arena.execute([&] {
                tbb::parallel_for(std::size_t(0), odd, visit);
                tbb::parallel_for(odd, end, visit);
            });
        }
    }
    count_voxels(state, double(end) * kLeafSize, kernel.bytes);
}

bool register_all() {
    for (const Kernel& kernel : kKernels)
        for (const SchemeKernels* set : available_kernels())
            for (const auto& [where, side, threads] :
                 {std::tuple{"cache", kSmallSide, 1}, {"memory", kLargeSide, 1}, {"memory", kLargeSide, 2}}) {
                const std::string name = std::string("kernel/") + kernel.name + '/' + set->name + '/' + where + '/' +
                                         std::to_string(threads);
                benchmark::RegisterBenchmark(name.c_str(),
                                             [&kernel, set, side = side, threads = threads](benchmark::State& state) {
                                                 run_on(state, kernel, *set, side, threads);
                                             })
                    ->UseRealTime()
                    ->MeasureProcessCPUTime();
            }
    for (const int threads : {1, 2})
        benchmark::RegisterBenchmark(("stream/triad/" + std::to_string(threads)).c_str(),
                                     [threads](benchmark::State& state) { triad(state, threads); })
            ->UseRealTime()
            ->MeasureProcessCPUTime();
    return true;
}

const bool registered = register_all();

}  // namespace
}  // namespace covol::bench
