#pragma once
#include <array>
#include <cstddef>
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
    /// At a node; without those of a guess.
    [[nodiscard]] Features at(std::size_t node) const {
        Features all{};
        for (int f = 0; f < kOfImage; ++f) all[std::size_t(f)] = (*this)[f][node];
        return all;
    }
    /// What surface costs at each node by the slope there, in (0,1]: half where it is as steep as at the median of the
    /// places, which lie on the surface.
    [[nodiscard]] Field edge(const Lattice& lattice, const std::vector<Vec3>& places) const;
    /// The slope at the scale that edges are weighed by.
    [[nodiscard]] const Field& slope() const { return fields_[4]; }
    [[nodiscard]] const Field& image() const { return image_; }

private:
    Field image_;
    std::array<Field, kOfImage> fields_;
};

/// `most` of the nodes at most, evenly.
[[nodiscard]] std::vector<std::size_t> some_of(const std::vector<std::size_t>& nodes, std::size_t maximum);

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
