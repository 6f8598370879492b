#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "inference/lattice.h"

namespace covol::inference {

/// Features of a position: smoothed intensity, its slope (the magnitude of the gradient) and its Laplacian at several
/// scales, and two features of the guess.
inline constexpr int kScales = 3, kOfImage = 3 * kScales, kFeatures = kOfImage + 2;
using Features = std::array<float, kFeatures>;

/// The image's features at the nodes of a lattice.
class ImageFeatures {
public:
    ImageFeatures(const Lattice& lattice, Field image);
    [[nodiscard]] const Field& operator[](int n) const { return fields_[std::size_t(n)]; }
    /// The features of a node; those of the guess are 0.
    [[nodiscard]] Features at(std::size_t node) const {
        Features all{};
        for (int f = 0; f < kOfImage; ++f) all[std::size_t(f)] = (*this)[f][node];
        return all;
    }
    /// The cost per area of a surface through each node, in (0,1]. It decreases with the slope of the image, and is one
    /// half if the slope equals its median over `places`, which lie on the surface.
    [[nodiscard]] Field edge(const Lattice& lattice, const std::vector<Vec3>& places) const;
    /// The slope at the middle scale, from which edge() is computed.
    [[nodiscard]] const Field& slope() const { return fields_[4]; }
    [[nodiscard]] const Field& image() const { return image_; }

private:
    Field image_;
    std::array<Field, kOfImage> fields_;
};

/// At most `maximum` of the nodes, selected at regular intervals.
[[nodiscard]] std::vector<std::size_t> some_of(const std::vector<std::size_t>& nodes, std::size_t maximum);

struct Sample {
    Features at{};
    bool inside = false;
    float weight = 1;
    int fold = 0;
};

/// Quadratic logistic regression: log odds of inside against outside. The coefficients of the standardised features
/// have a prior of unit variance.
class Appearance {
public:
    Appearance(const std::vector<Sample>& samples, int without_fold = -1);
    [[nodiscard]] double log_odds(const Features& at) const;

private:
    static constexpr int kTerms = 1 + kFeatures + kFeatures * (kFeatures + 1) / 2;
    void expand(const Features& at, float* terms) const;
    Features mean_{}, scale_{}, low_{}, high_{};
    std::array<float, kTerms> weights_{};
};

/// Information in bits per sample that a regression gives about the side of samples in folds on which it was not
/// trained: 1 for a perfect prediction, 0 for one that is no better than chance.
[[nodiscard]] double held_out_bits(const std::vector<Sample>& samples, int folds);

}  // namespace covol::inference
