#include "edge/nth_value.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

namespace covol::detail {
namespace {

constexpr int kBits = 12;                // a histogram has 2^kBits bins
constexpr std::size_t kBlock = 1 << 16;  // number of values that are counted by one task
using Histogram = std::array<std::uint32_t, std::size_t(1) << kBits>;

/// The upper bits of an integer that has the same order as the values.
std::uint32_t bin_of(float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return (bits >> 31 ? ~bits : bits | 0x80000000U) >> (32 - kBits);
}

}  // namespace

float nth_value(const std::vector<float>& values, std::size_t n) {
    const std::size_t blocks = (values.size() + kBlock - 1) / kBlock;
    std::vector<Histogram> counts(blocks);
    const auto end_of = [&](std::size_t block) { return std::min((block + 1) * kBlock, values.size()); };
    tbb::parallel_for(std::size_t(0), blocks, [&](std::size_t block) {
        for (std::size_t v = block * kBlock; v < end_of(block); ++v) ++counts[block][bin_of(values[v])];
    });
    std::uint32_t bin = 0;
    std::size_t before = 0;
    std::vector<std::size_t> first(blocks + 1);  // for each block, index in `among` of its first value
    for (;; ++bin) {
        for (std::size_t block = 0; block < blocks; ++block) first[block + 1] = first[block] + counts[block][bin];
        if (n < before + first.back()) break;
        before += first.back();
    }
    std::vector<float> among(first.back());
    tbb::parallel_for(std::size_t(0), blocks, [&](std::size_t block) {
        float* to = among.data() + first[block];
        for (std::size_t v = block * kBlock; v < end_of(block); ++v)
            if (bin_of(values[v]) == bin) *to++ = values[v];
    });
    const auto at = among.begin() + std::ptrdiff_t(n - before);
    std::nth_element(among.begin(), at, among.end());
    return *at;
}

}  // namespace covol::detail
