#include "stream.h"

#include <tbb/blocked_range.h>
#include <tbb/cache_aligned_allocator.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <vector>

#include "counters.h"

namespace covol::bench {
namespace {

constexpr std::size_t kFloats = std::size_t(48) << 20;  // 192 MiB for each of three arrays
constexpr std::size_t kChunk = std::size_t(1) << 18;

}  // namespace

void triad(benchmark::State& state, int threads) {
    using Array = std::vector<float, tbb::cache_aligned_allocator<float>>;
    Array a(kFloats, 0.0F), b(kFloats, 1.0F), c(kFloats, 2.0F);
    tbb::task_arena arena(threads);
    for (auto _ : state)
        arena.execute([&] {
            tbb::parallel_for(
                tbb::blocked_range<std::size_t>(0, kFloats, kChunk),
                [to = a.data(), x = b.data(), y = c.data()](const tbb::blocked_range<std::size_t>& range) {
                    for (std::size_t n = range.begin(); n != range.end(); ++n) to[n] = x[n] + 3.0F * y[n];
                });
        });
    count_voxels(state, double(kFloats), 3 * sizeof(float));
}

}  // namespace covol::bench
