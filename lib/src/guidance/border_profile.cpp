#include "guidance/border_profile.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "covol/guess.h"
#include "guidance/heuristics.h"
#include "guidance/profile_kernel.h"

namespace covol::guidance {
namespace {

// Number of steps beyond kBorderSteps, on each side, that contribute to the distributions of inside and outside.
constexpr int kFarSteps = 4 * kStepsPerVoxel;

/// Gaussian blur of `count` values with the given stride; the kernel is normalised so that their sum is preserved.
void blur(double* values, int count, int stride, double sigma) {
    const int radius = int(std::ceil(2.5 * sigma));
    std::vector<double> out(count, 0.0), kernel(2 * radius + 1);
    for (int n = -radius; n <= radius; ++n) kernel[n + radius] = std::exp(-0.5 * n * n / (sigma * sigma));
    for (int n = 0; n < count; ++n) {
        double total = 0;
        for (int m = std::max(n - radius, 0); m <= std::min(n + radius, count - 1); ++m)
            total += kernel[m - n + radius];
        for (int m = std::max(n - radius, 0); m <= std::min(n + radius, count - 1); ++m)
            out[m] += values[n * stride] * kernel[m - n + radius] / total;
    }
    for (int n = 0; n < count; ++n) values[n * stride] = out[n];
}

}  // namespace

void BorderProfile::Counts::add(const Counts& other, double weight) {
    add_weighted(border.data(), other.border.data(), weight, border.size());
    add_weighted(inside.data(), other.inside.data(), weight, inside.size());
    add_weighted(outside.data(), other.outside.data(), weight, outside.size());
}

BorderProfile::BorderProfile(std::vector<MarkedPlace> places) : places_(std::move(places)) {
    // The levels are separated by quantiles: each contains the same number of samples near the marks.
    std::vector<float> all;
    for (const MarkedPlace& place : places_) {
        const PatchProfile& p = place.profile;
        const int middle = int(std::lround(place.offset));
        for (int row = 0; row < p.rows; ++row)
            for (int s = std::max(p.lo, middle - kBorderSteps - kFarSteps);
                 s <= std::min(p.hi, middle + kBorderSteps + kFarSteps); ++s)
                all.push_back(p.values[std::size_t(row) * p.steps() + s - p.lo]);
    }
    tbb::parallel_sort(all.begin(), all.end());
    for (int n = 1; n < kLevels && !all.empty(); ++n) edges_.push_back(all[all.size() * n / kLevels]);
    edges_.resize(kLevels, std::numeric_limits<float>::infinity());
    counts_.resize(places_.size());
    tbb::parallel_for(std::size_t(0), places_.size(), [&](std::size_t n) {
        count_levels(places_[n].profile);
        counts_[n] = count(places_[n]);
    });
    for (const Counts& c : counts_) all_.add(c, 1);
}

void BorderProfile::count_levels(PatchProfile& p) const {
    p.seen.assign(std::size_t(p.steps()) * kLevels, 0.0F);
    const float* value = p.values.data();
    for (int row = 0; row < p.rows; ++row)
        for (int s = 0; s < p.steps(); ++s, ++value) {
            int level = 0;
            for (int n = 0; n < kLevels; ++n) level += edges_[std::size_t(n)] <= *value;
            ++p.seen[std::size_t(s) * kLevels + std::size_t(std::min(level, kLevels - 1))];
        }
}

BorderProfile::Counts BorderProfile::count(const MarkedPlace& place) const {
    Counts c;
    const PatchProfile& p = place.profile;
    const int below = int(std::floor(place.offset));
    const double part = place.offset - below;
    for (int s = p.lo; s <= p.hi; ++s) {
        const float* seen = p.seen.data() + std::size_t(s - p.lo) * kLevels;
        for (int level = 0; level < kLevels; ++level)
            for (int n = 0; n < 2; ++n) {
                const int depth = s - below - n;
                const double weight = (n == 0 ? 1 - part : part) * double(seen[level]) / p.rows;
                if (std::abs(depth) <= kBorderSteps)
                    c.border[std::size_t(depth + kBorderSteps) * kLevels + level] += weight;
                if (depth < -kBorderSteps / 2 && depth >= -kBorderSteps - kFarSteps)
                    c.inside[level] += weight / kFarSteps;
                if (depth > kBorderSteps / 2 && depth <= kBorderSteps + kFarSteps)
                    c.outside[level] += weight / kFarSteps;
            }
    }
    // Blur along the normal by the standard deviation of a mark that may lie anywhere in its voxel.
    for (int level = 0; level < kLevels; ++level)
        blur(c.border.data() + level, kDepths, kLevels, kUniformDeviation * kStepsPerVoxel);
    for (int depth = 0; depth < kDepths; ++depth)
        blur(c.border.data() + std::size_t(depth) * kLevels, kLevels, 1, kGuide.level_blur);
    blur(c.inside.data(), kLevels, 1, kGuide.level_blur);
    blur(c.outside.data(), kLevels, 1, kGuide.level_blur);
    return c;
}

BorderProfile::Counts BorderProfile::sum(const std::vector<double>& weights) const {
    constexpr double kIgnoredWeight = 1e-8;  // differences of weights up to this are ignored
    // If most weights are 1, the sum starts from all_, which has weight 1 for all places, so that only the places with
    // other weights have to be added.
    const auto ones = std::count(weights.begin(), weights.end(), 1.0);
    const double maximum = 2 * ones > std::ptrdiff_t(weights.size()) ? 1.0 : 0.0;
    Counts total = maximum > 0 ? all_ : Counts();
    for (std::size_t n = 0; n < counts_.size(); ++n)
        if (std::abs(weights[n] - maximum) > kIgnoredWeight) total.add(counts_[n], weights[n] - maximum);
    return total;
}

/// Converts counts to probabilities, shrunk towards those of `base`. Without `base`, inside and outside are shrunk
/// towards a uniform distribution, and each depth of the border towards a mixture of inside and outside.
void BorderProfile::normalise(Counts& c, const Counts* base) {
    const auto mix = [](double* values, const double* prior, double belief) {
        double total = 0;
        for (int level = 0; level < kLevels; ++level) total += values[level];
        for (int level = 0; level < kLevels; ++level)
            values[level] = (values[level] + belief * prior[level]) / (total + belief);
    };
    std::vector<double> prior(kLevels, 1.0 / kLevels);
    mix(c.inside.data(), base ? base->inside.data() : prior.data(), kGuide.belief);
    mix(c.outside.data(), base ? base->outside.data() : prior.data(), kGuide.belief);
    for (int depth = 0; depth < kDepths; ++depth) {
        double* row = c.border.data() + std::size_t(depth) * kLevels;
        const double out = std::clamp(0.5 + double(depth - kBorderSteps) / (2.0 * kStepsPerVoxel), 0.0, 1.0);
        for (int level = 0; level < kLevels; ++level)
            prior[level] = (1 - out) * c.inside[level] + out * c.outside[level];
        mix(row, base ? base->border.data() + std::size_t(depth) * kLevels : prior.data(), kGuide.belief);
    }
}

BorderTable BorderProfile::table(const std::vector<double>& weights, const std::vector<double>* base_weights) const {
    Counts counts = sum(weights);
    if (base_weights != nullptr) {
        Counts base = sum(*base_weights);
        normalise(base, nullptr);
        normalise(counts, &base);
    } else {
        normalise(counts, nullptr);
    }
    BorderTable table;
    const auto logs = [](const std::vector<double>& p) {
        std::vector<float> out(p.size());
        for (std::size_t n = 0; n < p.size(); ++n) out[n] = float(std::log(p[n]));
        return out;
    };
    table.border = logs(counts.border);
    table.inside = logs(counts.inside);
    table.outside = logs(counts.outside);
    return table;
}

void BorderTable::likelihood(const PatchProfile& p, int first, std::vector<double>& out) const {
    static_assert(kLevels % 8 == 0);
    const int steps = p.steps();
    const auto seen = [&](int s) { return p.seen.data() + std::size_t(s) * kLevels; };
    std::vector<double> in_sum(steps + 1), out_sum(steps + 1);
    for (int s = 0; s < steps; ++s) {
        in_sum[s + 1] = in_sum[s] + double(sum_of_products(seen(s), inside.data(), kLevels));
        out_sum[s + 1] = out_sum[s] + double(sum_of_products(seen(s), outside.data(), kLevels));
    }
    const double per_row = 1.0 / (double(p.rows) * kStepsPerVoxel);
    for (std::size_t n = 0; n < out.size(); ++n) {
        const int at = first + int(n) - p.lo;
        const int begin = std::clamp(at - kBorderSteps, 0, steps), end = std::clamp(at + kBorderSteps + 1, 0, steps);
        double sum = in_sum[begin] + out_sum[steps] - out_sum[end];
        if (begin < end)
            sum += double(sum_of_products(seen(begin), border.data() + std::size_t(begin - at + kBorderSteps) * kLevels,
                                          std::size_t(end - begin) * kLevels));
        out[n] += sum * per_row;
    }
}

}  // namespace covol::guidance
