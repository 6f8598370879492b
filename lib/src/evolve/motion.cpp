#include "evolve/motion.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "base/heuristics.h"
#include "covol/domain.h"
#include "evolve/change_kernel.h"
#include "evolve/heuristics.h"
#include "evolve/state_file.h"
#include "grid/sign_masks.h"

namespace covol::detail {
namespace {

constexpr std::size_t kFewJumps = 8;

// Minimum divisor of a leaf's mean motion, because a mean over fewer crossings (pairs of neighbouring voxels with the
// front between them) is unreliable: half the number of voxels of a leaf's face.
constexpr int kFewCrossings = kLeafDim * kLeafDim / 2;

// [voxels] A voxel counts as deep if it was at least this far from the front when the band was built. This is one voxel
// less than the distance at which u is clamped if the image is used. If the front has passed a deep voxel in any leaf,
// the band is rebuilt at once.
constexpr auto kDeep = float(kHalfWidthVoxels - 1);

double crossing(float a, float b) { return double(a) / (double(a) - b); }

int crossed_edges(const LeafMask& negative, const LeafMask& in_domain) {
    int crossed = 0;
    for (int axis = 0; axis < 3; ++axis) crossed += count_on(sign_changes(negative, in_domain, axis));
    return crossed;
}

struct Flips {
    std::int64_t flipped = 0, crossed = 0;
    Flips operator+(const Flips& o) const { return {flipped + o.flipped, crossed + o.crossed}; }
};

void find_signs(const LeafMask& negative, const LeafMask& in_domain, LeafMotion& motion) {
    for (int word = 0; word < 8; ++word) {
        motion.negative |= (negative[word] & in_domain[word]) != 0;
        motion.positive |= (~negative[word] & in_domain[word]) != 0;
    }
}

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

LeafMotion without_comparison(const float* values, const LeafMask& in_domain) {
    LeafMotion motion;
    find_signs(negative_mask(values), in_domain, motion);
    return motion;
}

LeafMotion motion_of(const float* now, const float* before, const LeafMask& in_domain) {
    LeafMotion motion;
    const Change change = change_of(now, before);
    motion.finite = change.finite;
    motion.largest = change.largest;
    const LeafMask negative = negative_mask(now);
    find_signs(negative, in_domain, motion);
    const LeafMask was_negative = negative_mask(before);
    if (negative == was_negative && !(motion.negative && motion.positive)) return motion;
    for (int axis = 0; axis < 3; ++axis) {
        const LeafMask after = sign_changes(negative, in_domain, axis),
                       first = sign_changes(was_negative, in_domain, axis);
        const int step = 64 >> (3 * axis);
        for (int word = 0; word < 8; ++word)
            for (std::uint64_t bits = after[word] | first[word]; bits != 0; bits &= bits - 1) {
                const int n = word << 6 | __builtin_ctzll(bits);
                ++motion.edges;
                motion.displacement +=
                    is_on(after, n) && is_on(first, n)
                        ? std::abs(crossing(now[n], now[n + step]) - crossing(before[n], before[n + step]))
                        : 0.5;
            }
    }
    return motion;
}

Motion total(const std::vector<LeafMotion>& leaves) {
    Motion motion;
    double displacement = 0.0;
    std::int64_t edges = 0;
    bool negative = false, positive = false;
    for (const LeafMotion& leaf : leaves) {
        displacement += leaf.displacement;
        edges += leaf.edges;
        negative |= leaf.negative;
        positive |= leaf.positive;
        motion.finite &= leaf.finite;
    }
    motion.crosses = negative && positive;
    motion.mean = edges > 0 ? displacement / static_cast<double>(edges) : 0.0;
    return motion;
}

double NetMotion::per_step(const BandValues& u) {
    if (++age_ < kWindow && !signs_.empty()) return std::numeric_limits<double>::infinity();
    const bool is_first = signs_.size() != u.size();
    signs_.resize(u.size());
    const Flips flips = sum_over_leaves(u.size(), [&](std::size_t leaf) {
        const LeafMask negative = negative_mask(u.leaf(leaf));
        const LeafMask in_domain = u.in_domain(leaf);
        Flips here{0, crossed_edges(negative, in_domain)};
        for (int word = 0; word < 8; ++word)
            here.flipped += __builtin_popcountll((negative[word] ^ signs_[leaf][word]) & in_domain[word]);
        signs_[leaf] = negative;
        return here;
    });
    age_ = 0;
    if (is_first || flips.crossed == 0) return std::numeric_limits<double>::infinity();
    return kCrossingsPerVoxel * double(flips.flipped) / double(flips.crossed) / kWindow;
}

void NetMotion::exchange(StateFile& file) {
    file.list(signs_);
    file.value(age_);
}

CrossingMarks::Displacement CrossingMarks::renew(std::size_t leaf, const float* u, const LeafMask& in_domain) {
    std::vector<Crossing> now;
    double squared_slope = 0.0;
    const LeafMask negative = negative_mask(u);
    for (int axis = 0; axis < 3; ++axis) {
        const LeafMask changes = sign_changes(negative, in_domain, axis);
        const int step = 64 >> (3 * axis);
        const std::size_t first = now.size();
        double jumps = 0.0;
        for (int word = 0; word < 8; ++word)
            for (std::uint64_t bits = changes[word]; bits != 0; bits &= bits - 1) {
                const int n = word << 6 | __builtin_ctzll(bits);
                now.push_back({std::uint16_t(axis * kLeafSize + n), float(crossing(u[n], u[n + step]))});
                jumps += std::abs(double(u[n]) - u[n + step]);
            }
        // If the front is a plane, the jump of u on each edge along an axis that it crosses is the component of grad u
        // along that axis; it crosses no such edge only if the component is small.
        const auto crossed = double(now.size() - first);
        if (crossed > 0) squared_slope += (jumps / crossed) * (jumps / crossed);
    }
    const double slope = now.size() >= kFewJumps ? std::sqrt(squared_slope) : 1.0;
    Leaf& mark = leaves_[leaf];
    double sum = 0.0, largest = 0.0;
    int edges = 0;
    const auto add = [&](double displacement) {
        sum += displacement;
        largest = std::max(largest, displacement);
        ++edges;
    };
    auto before = mark.crossings.begin();
    const auto end = mark.crossings.end();
    for (const Crossing& c : now) {
        for (; before != end && before->edge < c.edge; ++before) add(0.5);
        const bool same = before != end && before->edge == c.edge;
        add(same ? std::abs(c.at - before->at) : 0.5);
        before += same;
    }
    for (; before != end; ++before) add(0.5);
    const bool is_first = !mark.is_marked;
    mark = {std::move(now), true};
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (is_first) return {kInfinity, kInfinity, slope};
    return {edges > 0 ? sum / edges : 0.0, largest, slope};
}

void CrossingMarks::remake(const std::vector<std::int32_t>& old_leaf) {
    std::vector<Leaf> leaves(old_leaf.size());
    for (std::size_t leaf = 0; leaf < leaves.size(); ++leaf)
        if (old_leaf[leaf] >= 0) leaves[leaf] = std::move(leaves_[old_leaf[leaf]]);
    leaves_ = std::move(leaves);
}

void CrossingMarks::exchange(StateFile& file) {
    file.same(leaves_.size());
    for (Leaf& leaf : leaves_) {
        file.list(leaf.crossings);
        file.value(leaf.is_marked);
    }
}

FrontDisplacement::Reference::Reference(const float* values, const LeafMask& in_domain)
    : negative(negative_mask(values)), crossed(crossed_edges(negative, in_domain)) {
    for (int n = 0; n < kLeafSize; ++n) near[n >> 6] |= std::uint64_t(std::abs(values[n]) < kDeep) << (n & 63);
}

void FrontDisplacement::set_references(const BandValues& u) { remake(std::vector<std::int32_t>(u.size(), -1), u); }

void FrontDisplacement::remake(const std::vector<std::int32_t>& old_leaf, const BandValues& u) {
    std::vector<Reference> references(old_leaf.size());
    tbb::parallel_for(std::size_t(0), old_leaf.size(), [&](std::size_t leaf) {
        references[leaf] =
            old_leaf[leaf] >= 0 ? references_[old_leaf[leaf]] : Reference(u.leaf(leaf), u.in_domain(leaf));
    });
    references_ = std::move(references);
}

std::vector<std::size_t> FrontDisplacement::due_leaves(const BandValues& u) const {
    enum State : unsigned char { kStays, kLeaving, kLeft, kDeepDown };
    std::vector<State> states(references_.size());
    tbb::parallel_for(std::size_t(0), references_.size(), [&](std::size_t leaf) {
        const Reference& made = references_[leaf];
        const LeafMask negative = negative_mask(u.leaf(leaf)), in_domain = u.in_domain(leaf);
        int flips = 0;
        bool deep = false;
        for (int word = 0; word < 8; ++word) {
            const std::uint64_t flipped = (negative[word] ^ made.negative[word]) & in_domain[word];
            deep |= (flipped & ~made.near[word]) != 0;
            flips += __builtin_popcountll(flipped);
        }
        const double moved = flips > 0 ? kCrossingsPerVoxel * flips / std::max(made.crossed, kFewCrossings) : 0.0;
        // A leaf in which the front has moved half of kMotion.left_by is rebuilt together with those that are due;
        // otherwise the band would have to be rebuilt again soon.
        states[leaf] = deep                           ? kDeepDown
                       : moved >= kMotion.left_by     ? kLeft
                       : moved >= kMotion.left_by / 2 ? kLeaving
                                                      : kStays;
    });
    std::vector<std::size_t> leaving;
    std::size_t crossed = 0, left = 0;
    bool deep = false;
    for (std::size_t leaf = 0; leaf < states.size(); ++leaf) {
        crossed += references_[leaf].crossed > 0;
        left += states[leaf] >= kLeft;
        deep |= states[leaf] == kDeepDown;
        if (states[leaf] >= kLeaving) leaving.push_back(leaf);
    }
    if (!deep && double(left) < kCommon.minority * double(crossed)) leaving.clear();
    return leaving;
}

void FrontDisplacement::exchange(StateFile& file) {
    file.same(references_.size());
    file.array(references_.data(), references_.size());
}

}  // namespace covol::detail
