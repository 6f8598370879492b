#pragma once
#include <benchmark/benchmark.h>

namespace covol::bench {

/// The machine's memory bandwidth on that many threads: a = b + s c on arrays far larger than the caches (STREAM's
/// triad, 12 bytes for each float; what a store reads before it writes is not counted, there nor in the kernels).
void triad(benchmark::State& state, int threads);

}  // namespace covol::bench
