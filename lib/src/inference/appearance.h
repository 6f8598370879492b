#pragma once
#include <array>
#include <vector>

#include "inference/lattice.h"

namespace covol::inference {

/// What is known of a place: smoothed brightness, slope and Laplacian at several scales, and the guess.
inline constexpr int kScales = 3, kOfImage = 3 * kScales, kFeatures = kOfImage + 2;
using Features = std::array<float, kFeatures>;

/// The image's features at the nodes of a lattice.
class ImageFeatures {
public:
    ImageFeatures(const Lattice& lattice, Field image);
    [[nodiscard]] const Field& operator[](int n) const { return fields_[std::size_t(n)]; }
    /// The slope at the scale that edges are weighed by.
    [[nodiscard]] const Field& slope() const { return fields_[4]; }
    [[nodiscard]] const Field& image() const { return image_; }

private:
    Field image_;
    std::array<Field, kOfImage> fields_;
};

struct Sample {
    Features at{};
    bool inside = false;
    float weight = 1;
    int fold = 0;
};

/// Quadratic logistic regression with a ridge: log odds of inside against outside.
class Appearance {
public:
    Appearance(const std::vector<Sample>& samples, double ridge, int without_fold = -1);
    [[nodiscard]] double log_odds(const Features& at) const;

private:
    static constexpr int kTerms = 1 + kFeatures + kFeatures * (kFeatures + 1) / 2;
    void expand(const Features& at, float* terms) const;
    Features mean_{}, scale_{}, low_{}, high_{};
    std::array<float, kTerms> weights_{};
};

/// What a regression tells of the folds that it was not trained at, bits of each sample: 1 is everything, 0 nothing.
[[nodiscard]] double held_out_bits(const std::vector<Sample>& samples, double ridge, int folds);

}  // namespace covol::inference
