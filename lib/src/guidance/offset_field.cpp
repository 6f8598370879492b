#include "guidance/offset_field.h"

#include <tbb/parallel_for.h>

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/heuristics.h"
#include "guidance/conjugate_gradients.h"

namespace covol::guidance {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

// Relative residual for conjugate gradients. The field's range is a few patches, so that about ten iterations suffice
// for any number of patches, whereas the work of a factorization grows with the power 1.5 of it (86,000 patches: 8 s
// instead of 0.07 s). An incomplete factorization takes longer than it saves. The choice between priors requires this
// accuracy: with 1e-5 another prior may be chosen, and the surface of a spleen then moves by 0.05 voxels.
constexpr double kSolved = 1e-8;

}  // namespace

// A Matern field of smoothness 1 (F. Lindgren, H. Rue, J. Lindström 2011): (kappa^2 - Laplace) f = white noise,
// discretised by finite volumes on the patches. Its variance is 1 / (4 pi kappa^2 tau^2).
OffsetField::OffsetField(const Patches& patches, double range) : patches_(patches) {
    const std::size_t count = patches.size();
    const double kappa = std::sqrt(8.0) / range;
    std::vector<double> diagonal(count);
    for (std::size_t i = 0; i < count; ++i) diagonal[i] = kappa * kappa * patches.area[i];
    std::vector<Eigen::Triplet<double>> entries;
    for (const auto& border : patches.borders) {
        const double weight = border.length / std::max(border.distance, 1e-9);
        diagonal[border.a] += weight;
        diagonal[border.b] += weight;
        entries.emplace_back(border.a, border.b, -weight);
        entries.emplace_back(border.b, border.a, -weight);
    }
    for (std::size_t i = 0; i < count; ++i) entries.emplace_back(int(i), int(i), diagonal[i]);
    Sparse half{Eigen::Index(count), Eigen::Index(count)};
    half.setFromTriplets(entries.begin(), entries.end());
    const double tau2 = 1 / (4 * M_PI * kappa * kappa);
    std::vector<double> weight(count);
    for (std::size_t i = 0; i < count; ++i) weight[i] = tau2 / std::max(patches.area[i], 1e-12);
    precision_ = std::make_unique<SquaredMatrix>(std::move(half), std::move(weight));
}

OffsetField::~OffsetField() = default;

double moments(const OffsetEvidence& e, double mean, double variance, double& new_mean, double& new_variance) {
    double mass = 0, first = 0, second = 0, plain = 0;
    for (std::size_t n = 0; n < e.density.size(); ++n) {
        const double x = e.first + double(n) * e.step - mean;
        const double normal = std::exp(-0.5 * x * x / variance);
        const double weight = normal * e.density[n];
        plain += normal;
        mass += weight;
        first += weight * x;
        second += weight * x * x;
    }
    if (!(mass > 0) || !(plain > 0)) {
        new_mean = mean;
        new_variance = variance;
        return 1;
    }
    first /= mass;
    new_mean = mean + first;
    new_variance = std::max(second / mass - first * first, 0.0) + e.step * e.step / 12;
    return mass / plain;
}

OffsetField::Fit OffsetField::fit(const std::vector<double>& mean, const std::vector<double>& deviation,
                                  const std::vector<OffsetEvidence>& evidence, const std::vector<double>& fixed,
                                  const std::vector<double>& fixed_precision, const std::vector<double>* shift) const {
    const std::size_t count = patches_.size();
    Fit result{mean, std::vector<double>(count, 0.0), {}};
    const bool requested =
        std::any_of(evidence.begin(), evidence.end(), [](const OffsetEvidence& e) { return !e.density.empty(); });
    // Offsets are divided by the deviation, so that the field has unit variance.
    const auto to_units = [&](std::vector<double> values) {
        for (std::size_t i = 0; i < count; ++i) values[i] /= deviation[i];
        return values;
    };
    const auto from_units = [&](std::vector<double> values) {
        for (std::size_t i = 0; i < count; ++i) values[i] *= deviation[i];
        return values;
    };
    std::vector<double> field = to_units(mean);
    const std::vector<double> pull = *precision_ * field;
    std::vector<double> site(count, 0.0), prior_precision(count), known(count, 0.0), right(count);
    for (int round = 0; round < (requested ? kCommon.rounds : 1); ++round) {
        // The prior of a patch for its evidence has the current offset as its mean. Its precision is that of the
        // patch's own prior and fixed offset, plus half of the precision of each neighbour's evidence and fixed offset.
        for (std::size_t i = 0; i < count; ++i) {
            prior_precision[i] = 1 / (deviation[i] * deviation[i]) + fixed_precision[i];
            for (const std::uint32_t j : patches_.neighbours[i])
                prior_precision[i] += 0.5 * (result.precision[j] + fixed_precision[j]);
        }
        tbb::parallel_for(std::size_t(0), count, [&](std::size_t i) {
            if (evidence[i].density.empty()) return;
            double m, v;
            const double centre = result.offset[i];
            moments(evidence[i], centre, 1 / prior_precision[i], m, v);
            const double gained = std::max(1 / v - prior_precision[i], 0.0);
            site[i] = gained > 0 ? (m / v - centre * prior_precision[i]) / gained : 0;
            result.precision[i] = gained;
        });
        for (std::size_t i = 0; i < count; ++i) {
            known[i] = (result.precision[i] + fixed_precision[i]) * deviation[i] * deviation[i];
            right[i] = pull[i] + (result.precision[i] * site[i] + fixed_precision[i] * fixed[i]) * deviation[i];
        }
        conjugate_gradients(*precision_, known, right, kSolved, field);
        result.offset = from_units(field);
    }
    if (shift != nullptr) {
        std::vector<double> carried = to_units(*shift);
        conjugate_gradients(*precision_, known, *precision_ * carried, kSolved, carried);
        result.carried = from_units(std::move(carried));
    }
    return result;
}

}  // namespace covol::guidance
