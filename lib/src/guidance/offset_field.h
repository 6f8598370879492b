#pragma once
#include <memory>
#include <vector>

#include "guidance/patches.h"

namespace covol::guidance {

class SquaredMatrix;

/// The position of a patch's border according to the image: a density over offsets, relative to that of an image
/// without information.
struct OffsetEvidence {
    double first = 0, step = 1;  ///< offsets first + n * step, world units
    std::vector<float> density;  ///< mean 1; empty: unknown
};

/// A smooth random field of offsets on the patches, with the guess as its mean.
class OffsetField {
public:
    /// @param range      correlation length of the offsets
    /// @param deviation  by patch, prior standard deviation
    OffsetField(const Patches& patches, double range);
    ~OffsetField();

    struct Fit {
        std::vector<double> offset;
        std::vector<double> precision;  ///< of the image's offset, 1 / variance
        std::vector<double> carried;    ///< response of the offsets to a shift of the prior's mean
    };
    /// @param mean, deviation  the prior, by patch
    /// @param evidence         by patch
    /// @param fixed, fixed_precision  further known offsets (marks), by patch
    /// @param shift  of the prior's mean, for Fit::carried; may be null
    [[nodiscard]] Fit fit(const std::vector<double>& mean, const std::vector<double>& deviation,
                          const std::vector<OffsetEvidence>& evidence, const std::vector<double>& fixed,
                          const std::vector<double>& fixed_precision, const std::vector<double>* shift) const;

private:
    const Patches& patches_;
    std::unique_ptr<SquaredMatrix> precision_;  // of the field of unit variance
};

/// Mean and variance of a density times a normal distribution. @return its mass relative to that of the normal one.
double moments(const OffsetEvidence& evidence, double mean, double variance, double& new_mean, double& new_variance);

}  // namespace covol::guidance
