#include "inference/appearance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

#include "base/median.h"

namespace covol::inference {
namespace {

constexpr double kFeatureSigmas[kScales] = {0.6, 1.2, 2.4};  // [smallest spacing of the lattice]
constexpr int kRounds = 20;
constexpr double kConverged = 1e-2;  // Newton's method ends if no coefficient changes by more

}  // namespace

ImageFeatures::ImageFeatures(const Lattice& lattice, Field image) : image_(std::move(image)) {
    Field sorted = image_;
    const auto percentile = [&](double p) {
        const auto at = sorted.begin() + std::ptrdiff_t(p * double(sorted.size() - 1));
        std::nth_element(sorted.begin(), at, sorted.end());
        return *at;
    };
    const float low = percentile(0.01), high = percentile(0.99), range = std::max(high - low, 1e-20F);
    for (float& v : image_) v = std::clamp((v - low) / range, -0.5F, 1.5F);
    for (int s = 0; s < kScales; ++s) {
        const double sigma = kFeatureSigmas[s] * lattice.finest();
        Field smoothed = smooth(lattice, image_, sigma);
        Field slope(smoothed.size(), 0.0F), laplacian(smoothed.size(), 0.0F);
        for (int axis = 0; axis < 3; ++axis) {
            const Field first = derivative(lattice, smoothed, axis), second = derivative(lattice, first, axis);
            for (std::size_t n = 0; n < slope.size(); ++n) {
                slope[n] += first[n] * first[n];
                laplacian[n] += second[n];
            }
        }
        for (float& v : slope) v = float(sigma) * std::sqrt(v);
        for (float& v : laplacian) v *= float(sigma * sigma);
        fields_[std::size_t(3 * s)] = std::move(smoothed);
        fields_[std::size_t(3 * s + 1)] = std::move(slope);
        fields_[std::size_t(3 * s + 2)] = std::move(laplacian);
    }
}

Field ImageFeatures::edge(const Lattice& lattice, const std::vector<Vec3>& places) const {
    std::vector<double> slopes;
    for (const Vec3& place : places) slopes.push_back(lattice.value(slope(), place));
    const double usual = std::max(cloud::median(slopes), 1e-6);
    Field result(lattice.count());
    tbb::parallel_for(std::size_t(0), result.size(), [&](std::size_t n) {
        const double steep = double(slope()[n]) / usual;
        result[n] = float(1 / (1 + steep * steep));
    });
    return result;
}

std::vector<std::size_t> some_of(const std::vector<std::size_t>& nodes, std::size_t maximum) {
    std::vector<std::size_t> some;
    const std::size_t count = std::min(maximum, nodes.size());
    for (std::size_t m = 0; m < count; ++m) some.push_back(nodes[(2 * m + 1) * nodes.size() / (2 * count)]);
    return some;
}

void Appearance::expand(const Features& at, float* terms) const {
    Features z;
    for (int a = 0; a < kFeatures; ++a)
        z[std::size_t(a)] =
            (std::clamp(at[std::size_t(a)], low_[std::size_t(a)], high_[std::size_t(a)]) - mean_[std::size_t(a)]) *
            scale_[std::size_t(a)];
    int n = 0;
    terms[n++] = 1;
    for (const float v : z) terms[n++] = v;
    for (int a = 0; a < kFeatures; ++a)
        for (int b = a; b < kFeatures; ++b) terms[n++] = z[std::size_t(a)] * z[std::size_t(b)];
}

Appearance::Appearance(const std::vector<Sample>& samples, int without_fold) {
    std::vector<const Sample*> used;
    double total[2] = {0, 0};
    for (const Sample& s : samples) {
        if (s.fold == without_fold && without_fold >= 0) continue;
        used.push_back(&s);
        total[s.inside ? 1 : 0] += double(s.weight);
    }
    const double sum = total[0] + total[1];
    low_.fill(1e30F);
    high_.fill(-1e30F);
    std::array<double, kFeatures> mean{}, square{};
    for (const Sample* s : used)
        for (std::size_t a = 0; a < kFeatures; ++a) {
            mean[a] += double(s->weight) * double(s->at[a]) / sum;
            square[a] += double(s->weight) * double(s->at[a]) * double(s->at[a]) / sum;
            low_[a] = std::min(low_[a], s->at[a]);
            high_[a] = std::max(high_[a], s->at[a]);
        }
    for (std::size_t a = 0; a < kFeatures; ++a) {
        mean_[a] = float(mean[a]);
        scale_[a] = float(1 / (std::sqrt(std::max(square[a] - mean[a] * mean[a], 0.0)) + 1e-6));
    }
    using Matrix = Eigen::MatrixXd;
    using Vector = Eigen::VectorXd;
    const auto count = Eigen::Index(used.size());
    Matrix Z(count, kTerms);
    Vector y(count), weight(count);
    for (Eigen::Index n = 0; n < count; ++n) {
        std::array<float, kTerms> terms;
        expand(used[std::size_t(n)]->at, terms.data());
        for (int t = 0; t < kTerms; ++t) Z(n, t) = double(terms[std::size_t(t)]);
        const bool inside = used[std::size_t(n)]->inside;
        y[n] = inside ? 1 : 0;
        // Both sides get the same total weight, so that the odds depend on the position and not on the number of
        // samples.
        weight[n] = double(used[std::size_t(n)]->weight) * 0.5 * sum / std::max(total[inside ? 1 : 0], 1e-9);
    }
    Vector w = Vector::Zero(kTerms), penalty = Vector::Ones(kTerms);
    penalty[0] = 1e-6;
    for (int round = 0; round < kRounds; ++round) {
        const Vector odds = (Z * w).cwiseMax(-30).cwiseMin(30);
        const Vector p = (1 / (1 + (-odds.array()).exp())).matrix();
        const Vector curvature = (weight.array() * p.array() * (1 - p.array())).matrix();
        Matrix H = Matrix::Zero(kTerms, kTerms);
        const Matrix scaled = curvature.cwiseSqrt().asDiagonal() * Z;
        H.selfadjointView<Eigen::Lower>().rankUpdate(scaled.transpose());
        H.diagonal() += penalty;
        const Vector gradient = Z.transpose() * (weight.array() * (y - p).array()).matrix() - penalty.cwiseProduct(w);
        const Vector step = H.selfadjointView<Eigen::Lower>().llt().solve(gradient);
        w += step;
        if (step.cwiseAbs().maxCoeff() < kConverged) break;
    }
    for (int t = 0; t < kTerms; ++t) weights_[std::size_t(t)] = float(w[t]);
}

double Appearance::log_odds(const Features& at) const {
    std::array<float, kTerms> terms;
    expand(at, terms.data());
    float sum = 0;
    for (int t = 0; t < kTerms; ++t) sum += terms[std::size_t(t)] * weights_[std::size_t(t)];
    return double(sum);
}

double held_out_bits(const std::vector<Sample>& samples, int folds) {
    std::vector<double> lost(std::size_t(folds), 0.0), weight(std::size_t(folds), 0.0);
    tbb::parallel_for(0, folds, [&](int fold) {
        const Appearance appearance(samples, fold);
        for (const Sample& s : samples) {
            if (s.fold != fold) continue;
            const double odds = appearance.log_odds(s.at);
            lost[std::size_t(fold)] += double(s.weight) * std::log2(1 + std::exp(s.inside ? -odds : odds));
            weight[std::size_t(fold)] += double(s.weight);
        }
    });
    double all = 0, of = 0;
    for (int fold = 0; fold < folds; ++fold) all += lost[std::size_t(fold)], of += weight[std::size_t(fold)];
    return of > 0 ? 1 - all / of : 0;
}

}  // namespace covol::inference
