#pragma once
#include <benchmark/benchmark.h>

namespace covol::bench {

/// The machine's memory bandwidth with that many threads: a = b + s c on arrays much larger than the caches (STREAM's
/// triad, 12 bytes for each float; reads caused by write-allocation are not counted, neither here nor in the kernels).
void triad(benchmark::State& state, int threads);

}  // namespace covol::bench
