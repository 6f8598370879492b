#pragma once
#include <benchmark/benchmark.h>

namespace covol::bench {

/// Measures the machine's memory bandwidth with a number of threads by the triad of STREAM: a = b + s c on arrays much
/// larger than the caches. 12 bytes per float are counted. Reads of a, which the cache makes before it writes, are not
/// counted, as in the benchmarks of the kernels.
void triad(benchmark::State& state, int threads);

}  // namespace covol::bench
