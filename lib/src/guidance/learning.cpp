#include "guidance/learning.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/heuristics.h"
#include "guidance/grid_sampler.h"
#include "points/kd_tree.h"

namespace covol::guidance {
namespace {

constexpr int kBeyondRange = 3 * kStepsPerVoxel, kBeyondMark = 8 * kStepsPerVoxel;
// Along a path, an interpolated distance changes by at most sqrt(3) times the length of the path, plus a fraction of a
// voxel where the values of the narrow band meet those beyond it (WideDistance).
constexpr double kSteepest = 1.7320508, kSeam = 0.5;
constexpr std::array<double, 6> kSharpness{0.05, 0.1, 0.2, 0.4, 0.7, 1.0};
constexpr std::array<double, 4> kStray{0.02, 0.1, 0.25, 0.5};

double median(std::vector<double>& values) {
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

OffsetEvidence density(const std::vector<double>& log_likelihood, double first, double step, const Trust& trust) {
    OffsetEvidence e;
    e.first = first;
    e.step = step;
    const double top = *std::max_element(log_likelihood.begin(), log_likelihood.end());
    double sum = 0;
    e.density.reserve(log_likelihood.size());
    for (const double l : log_likelihood) {
        e.density.push_back(float(std::exp(trust.sharpness * (l - top))));
        sum += e.density.back();
    }
    const double mean = sum / double(log_likelihood.size());
    for (float& d : e.density) d = float(trust.stray + (1 - trust.stray) * d / mean);
    return e;
}

/// Log-likelihoods of successive offsets that are a step apart, from `first` steps on; no values if the profile is too
/// short.
struct Likelihood {
    int first = 0;
    std::vector<double> values;
};

Likelihood likelihood(const PatchProfile& profile, const BorderTable& table, int range) {
    Likelihood l;
    if (profile.empty()) return l;
    l.first = profile.image_ends_below ? -range : std::max(-range, profile.lo + 1);
    const int last = profile.image_ends_above ? range : std::min(range, profile.hi - 1);
    if (last - l.first < kStepsPerVoxel) return l;
    l.values.assign(std::size_t(last - l.first) + 1, 0.0);
    table.likelihood(profile, l.first, l.values);
    return l;
}

/// Gaussian weights of the marked places by their distance from `at`.
std::vector<double> around(const BorderProfile& profile, const Vec3& at, double radius) {
    std::vector<double> weights;
    for (const MarkedPlace& place : profile.places())
        weights.push_back(std::exp(-0.5 * detail::squared_distance(place.at, at) / (radius * radius)));
    return weights;
}

/// The median distance of a place to its `count`-th nearest other place.
double neighbourhood(const BorderProfile& profile, int count) {
    std::vector<double> radii;
    for (const MarkedPlace& a : profile.places()) {
        std::vector<double> squared;
        for (const MarkedPlace& b : profile.places()) squared.push_back(detail::squared_distance(a.at, b.at));
        std::nth_element(squared.begin(), squared.begin() + count, squared.end());
        radii.push_back(std::sqrt(squared[std::size_t(count)]));
    }
    return median(radii);
}

std::vector<MarkedPlace> places_of(const Scene& scene, const std::vector<PatchMark>& marks, const SmoothImage& image,
                                   double guess_deviation) {
    std::vector<MarkedPlace> places(marks.size());
    tbb::parallel_for(std::size_t(0), marks.size(), [&](std::size_t n) {
        const PatchMark& mark = marks[n];
        places[n].profile = read_profile(scene, mark.patch, scene.ranges[mark.patch] + kBeyondMark, image);
        // The expected position of the border between the surface and the mark, weighted by their variances.
        const double surface2 = guess_deviation * guess_deviation;
        places[n].offset = mark.residual * surface2 / (surface2 + mark.deviation * mark.deviation) /
                           (scene.patches.voxel[mark.patch] / kStepsPerVoxel);
        places[n].at = mark.at;
    });
    return places;
}

}  // namespace

PatchProfile read_profile(const Scene& scene, std::size_t patch, int reach, const SmoothImage& image) {
    const Patches& p = scene.patches;
    GridSampler distance(scene.distance, scene.domain);
    const double step = p.voxel[patch] / kStepsPerVoxel, h = scene.domain.voxel_size;
    struct Row {
        int lo = 0, hi = 0;
        float* values;  // points to the value at step 0
    };
    const std::size_t longest = 2 * std::size_t(reach) + 1;
    std::vector<float> values(longest * (p.first[patch + 1] - p.first[patch]));
    std::vector<Row> rows;
    std::vector<double> lows, highs;
    int ends_below = 0, ends_above = 0;
    for (std::uint32_t n = p.first[patch]; n < p.first[patch + 1]; ++n) {
        const Vec3 &x = p.places[p.members[n]], &normal = p.normals[p.members[n]];
        Row row;
        row.values = values.data() + rows.size() * longest + reach;
        const Vec3 first{x[0] + scene.shift[0], x[1] + scene.shift[1], x[2] + scene.shift[2]};
        const SmoothImage::Line line = image.along(first, {step * normal[0], step * normal[1], step * normal[2]});
        if (!line.sample(0, row.values[0])) continue;
        for (const int side : {-1, 1}) {
            int checked = 0;  // last step up to which no other part of the surface can be closer
            for (int s = 1; s <= reach; ++s) {
                if (s > checked) {
                    const double away = s * step;
                    const Vec3 at{x[0] + side * away * normal[0], x[1] + side * away * normal[1],
                                  x[2] + side * away * normal[2]};
                    // Stop if another part of the surface is closer: the distance is then less than kCommon.turn times
                    // the path along the normal, minus one voxel.
                    const double margin = side * distance(at) - (kCommon.turn * away - h);
                    if (margin < 0) break;
                    checked = s + int(std::max(margin - kSeam * h, 0.0) / ((kSteepest + kCommon.turn) * step));
                }
                if (!line.sample(side * s, row.values[side * s])) {
                    ++(side < 0 ? ends_below : ends_above);
                    break;
                }
                (side < 0 ? row.lo : row.hi) = side * s;
            }
        }
        lows.push_back(row.lo);
        highs.push_back(row.hi);
        rows.push_back(row);
    }
    PatchProfile profile;
    if (rows.empty()) return profile;
    // The same range for all rows, so that offsets are comparable; shorter rows are omitted.
    profile.lo = int(median(lows));
    profile.hi = int(median(highs));
    profile.image_ends_below = 2 * ends_below > int(rows.size());
    profile.image_ends_above = 2 * ends_above > int(rows.size());
    for (const Row& row : rows)
        if (row.lo <= profile.lo && row.hi >= profile.hi) {
            profile.values.insert(profile.values.end(), row.values + profile.lo, row.values + profile.hi + 1);
            ++profile.rows;
        }
    return profile;
}

LearntProfile::LearntProfile(const Scene& scene, const std::vector<PatchMark>& marks, const SmoothImage& image,
                             double guess_deviation, double prior_deviation, double apart)
    : profile_(places_of(scene, marks, image, guess_deviation)) {
    gain_ = -std::numeric_limits<double>::infinity();
    test(scene, marks, prior_deviation, apart, false);
    // For a profile that varies with the position, the profile at each mark is learnt from about kCommon.quadric nearby
    // marks.
    if (marks.size() > kCommon.quadric) {
        radius_ = std::max(neighbourhood(profile_, int(kCommon.quadric)), apart);
        test(scene, marks, prior_deviation, apart, true);
    }
    const std::vector<double> all(marks.size(), 1.0);
    tables_.resize(local_ ? marks.size() : 1);
    tbb::parallel_for(std::size_t(0), tables_.size(), [&](std::size_t n) {
        tables_[n] =
            local_ ? profile_.table(around(profile_, profile_.places()[n].at, radius_), &all) : profile_.table(all);
    });
}

/// Predicts each mark from the profile at the other marks, with several degrees of trust in the image. The profile and
/// the trust with the largest gain minus its standard error of all tests so far are kept.
/// @param local  whether nearby marks have higher weights
void LearntProfile::test(const Scene& scene, const std::vector<PatchMark>& marks, double prior_deviation, double apart,
                         bool local) {
    std::vector<BorderTable> tables(marks.size());
    std::vector<Likelihood> likelihoods(marks.size());
    tbb::parallel_for(std::size_t(0), marks.size(), [&](std::size_t n) {
        const MarkedPlace& place = profile_.places()[n];
        std::vector<double> others(marks.size(), 1.0), near;
        if (local) near = around(profile_, place.at, radius_);
        for (std::size_t k = 0; k < marks.size(); ++k)
            if (detail::squared_distance(profile_.places()[k].at, place.at) < apart * apart) {
                others[k] = 0;
                if (local) near[k] = 0;
            }
        tables[n] = local ? profile_.table(near, &others) : profile_.table(others);
        likelihoods[n] = likelihood(place.profile, tables[n], scene.ranges[marks[n].patch]);
    });
    struct Score {
        double gain, error;
    };
    std::array<Score, kSharpness.size() * kStray.size()> scores;
    tbb::parallel_for(std::size_t(0), scores.size(), [&](std::size_t at) {
        const Trust trust{kSharpness[at / kStray.size()], kStray[at % kStray.size()]};
        double sum = 0, squares = 0, count = 0;
        for (std::size_t n = 0; n < marks.size(); ++n) {
            if (likelihoods[n].values.empty()) continue;
            const double step = scene.patches.voxel[marks[n].patch] / kStepsPerVoxel;
            const OffsetEvidence e = density(likelihoods[n].values, likelihoods[n].first * step, step, trust);
            // The probability density of the mark: that of the border given prior and image, blurred by the mark's
            // error. It is divided by the same density without the image.
            const double prior2 = prior_deviation * prior_deviation,
                         mark2 = std::pow(std::max(marks[n].deviation, 0.5 * step), 2);
            double mean, variance;
            const double mass = moments(e, 0, prior2, mean, variance);
            const double near = moments(e, marks[n].residual * prior2 / (prior2 + mark2),
                                        prior2 * mark2 / (prior2 + mark2), mean, variance);
            const double gain = std::log(std::max(near, 1e-6) / std::max(mass, 1e-6));
            sum += gain;
            squares += gain * gain;
            ++count;
        }
        const double mean = count > 0 ? sum / count : -std::numeric_limits<double>::infinity();
        scores[at] = {mean, count > 0 ? std::sqrt(std::max(squares / count - mean * mean, 0.0) / count) : 0.0};
    });
    bool better = false;
    for (std::size_t at = 0; at < scores.size(); ++at)
        if (scores[at].gain - scores[at].error > gain_ - gain_error_) {
            gain_ = scores[at].gain;
            gain_error_ = scores[at].error;
            trust_ = {kSharpness[at / kStray.size()], kStray[at % kStray.size()]};
            better = true;
        }
    if (!better && !held_out_.empty()) return;
    held_out_ = std::move(tables);
    local_ = local;
}

LearntProfile::ProfileEvidence LearntProfile::query(const Scene& scene, std::size_t patch,
                                                    const SmoothImage& image) const {
    ProfileEvidence answer;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t n = 0; n < profile_.places().size(); ++n) {
        const double squared = detail::squared_distance(profile_.places()[n].at, scene.patches.centers[patch]);
        if (squared < nearest) {
            nearest = squared;
            answer.nearest = n;
        }
    }
    PatchProfile profile = read_profile(scene, patch, scene.ranges[patch] + kBeyondRange, image);
    profile_.count_levels(profile);
    const double step = scene.patches.voxel[patch] / kStepsPerVoxel;
    const auto evidence = [&](const BorderTable& table) {
        const Likelihood l = likelihood(profile, table, scene.ranges[patch]);
        return l.values.empty() ? OffsetEvidence{} : density(l.values, l.first * step, step, trust_);
    };
    answer.all = evidence(tables_[local_ ? answer.nearest : 0]);
    answer.held_out = evidence(held_out_[answer.nearest]);
    return answer;
}

double LearntProfile::brightness(int steps) const {
    std::vector<double> values;
    for (const MarkedPlace& place : profile_.places()) {
        const int at = int(std::lround(place.offset)) + steps;
        if (at < place.profile.lo || at > place.profile.hi) continue;
        for (int row = 0; row < place.profile.rows; ++row)
            values.push_back(
                place.profile.values[std::size_t(row) * place.profile.steps() + std::size_t(at - place.profile.lo)]);
    }
    return values.empty() ? 0 : median(values);
}

}  // namespace covol::guidance
