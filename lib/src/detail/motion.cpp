#include "detail/motion.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "detail/sign_masks.h"

namespace covol::detail {
namespace {

constexpr double kLeft = 0.75;   // voxels, on the average
constexpr float kDeep = 2.0F;    // voxels, anywhere

double crossing(float a, float b) { return double(a) / (double(a) - b); }

int crossed_edges(const LeafMask& negative) {
    int crossed = 0;
    for (int axis = 0; axis < 3; ++axis) crossed += count_on(sign_changes(negative, axis));
    return crossed;
}

struct Flips {
    std::int64_t flipped = 0, crossed = 0;
    bool deep = false;
    Flips operator+(const Flips& o) const { return {flipped + o.flipped, crossed + o.crossed, deep || o.deep}; }
};

template <typename Count>
Flips sum_over_leaves(std::size_t leaves, Count count) {
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, leaves, 64), Flips{},
        [&](const tbb::blocked_range<std::size_t>& range, Flips sum) {
            for (std::size_t leaf = range.begin(); leaf != range.end(); ++leaf) sum = sum + count(leaf);
            return sum;
        },
        std::plus<>());
}

}  // namespace

LeafMotion motion_of(const float* now, const float* before, bool is_active) {
    LeafMotion motion;
    // A sum is finite when every value is, and takes no branches.
    float sum = 0.0F, largest = 0.0F;
    for (int n = 0; n < kLeafSize; ++n) {
        sum += now[n];
        largest = std::max(largest, std::abs(now[n] - before[n]));
    }
    motion.finite = std::isfinite(sum);
    motion.largest = largest;
    const LeafMask negative = negative_mask(now);
    for (int word = 0; word < 8; ++word) {
        motion.negative |= negative[word] != 0;
        motion.positive |= ~negative[word] != 0;
    }
    if (!is_active) return motion;
    const LeafMask was_negative = negative_mask(before);
    if (negative == was_negative && !(motion.negative && motion.positive)) return motion;
    for (int axis = 0; axis < 3; ++axis) {
        const LeafMask after = sign_changes(negative, axis), first = sign_changes(was_negative, axis);
        const int step = 64 >> (3 * axis);
        for (int word = 0; word < 8; ++word)
            for (std::uint64_t bits = after[word] | first[word]; bits != 0; bits &= bits - 1) {
                const int n = word << 6 | __builtin_ctzll(bits);
                ++motion.edges;
                motion.way += is_on(after, n) && is_on(first, n)
                                  ? std::abs(crossing(now[n], now[n + step]) - crossing(before[n], before[n + step]))
                                  : 0.5;
            }
    }
    return motion;
}

Motion total(const std::vector<LeafMotion>& leaves) {
    Motion motion;
    double way = 0.0;
    std::int64_t edges = 0;
    bool negative = false, positive = false;
    for (const LeafMotion& leaf : leaves) {
        way += leaf.way;
        edges += leaf.edges;
        negative |= leaf.negative;
        positive |= leaf.positive;
        motion.finite &= leaf.finite;
    }
    motion.crosses = negative && positive;
    motion.mean = edges > 0 ? way / static_cast<double>(edges) : 0.0;
    return motion;
}

double NetMotion::per_step(const LeafArray<float>& u, std::size_t leaves) {
    if (++age_ < kWindow && !signs_.empty()) return std::numeric_limits<double>::infinity();
    const bool is_first = signs_.size() != leaves;
    signs_.resize(leaves);
    const Flips flips = sum_over_leaves(leaves, [&](std::size_t leaf) {
        const LeafMask negative = negative_mask(u.leaf(leaf));
        Flips here{0, crossed_edges(negative), false};
        for (int word = 0; word < 8; ++word) here.flipped += __builtin_popcountll(negative[word] ^ signs_[leaf][word]);
        signs_[leaf] = negative;
        return here;
    });
    age_ = 0;
    if (is_first || flips.crossed == 0) return std::numeric_limits<double>::infinity();
    return kCrossingsPerVoxel * double(flips.flipped) / double(flips.crossed) / kWindow;
}

void Departure::remember(const LeafArray<float>& u, std::size_t leaves) {
    made_for_.resize(leaves);
    tbb::parallel_for(std::size_t(0), leaves, [&](std::size_t leaf) {
        const float* values = u.leaf(leaf);
        MadeFor& made = made_for_[leaf];
        made.negative = negative_mask(values);
        made.near = {};
        for (int n = 0; n < kLeafSize; ++n) made.near[n >> 6] |= std::uint64_t(std::abs(values[n]) < kDeep) << (n & 63);
        made.crossed = crossed_edges(made.negative);
    });
}

bool Departure::has_left(const LeafArray<float>& u) const {
    const Flips flips = sum_over_leaves(made_for_.size(), [&](std::size_t leaf) {
        const MadeFor& made = made_for_[leaf];
        const LeafMask negative = negative_mask(u.leaf(leaf));
        Flips here{0, made.crossed, false};
        for (int word = 0; word < 8; ++word) {
            const std::uint64_t flipped = negative[word] ^ made.negative[word];
            here.deep |= (flipped & ~made.near[word]) != 0;
            here.flipped += __builtin_popcountll(flipped);
        }
        return here;
    });
    return flips.deep || double(flips.flipped) >= kLeft * double(flips.crossed) / kCrossingsPerVoxel;
}

}  // namespace covol::detail
