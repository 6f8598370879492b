#pragma once
#include <benchmark/benchmark.h>

namespace covol::bench {

/// Adds counters to a benchmark: voxels, per_voxel (seconds), and, if the memory traffic is known, bytes_per_voxel and
/// bytes_per_second. @param voxels  number of voxels that one iteration processes
inline void count_voxels(benchmark::State& state, double voxels, double bytes_per_voxel = 0) {
    using benchmark::Counter;
    state.counters["voxels"] = voxels;
    state.counters["per_voxel"] = Counter(voxels, Counter::kIsIterationInvariantRate | Counter::kInvert);
    if (bytes_per_voxel == 0) return;
    state.counters["bytes_per_voxel"] = bytes_per_voxel;
    state.counters["bytes_per_second"] = Counter(voxels * bytes_per_voxel, Counter::kIsIterationInvariantRate);
}

}  // namespace covol::bench
