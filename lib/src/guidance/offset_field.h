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
    std::vector<float> density;  ///< at these offsets, with a mean of 1; empty: unknown
};

/// A Gaussian random field of offsets on the patches, smooth along the surface.
class OffsetField {
public:
    /// @param range  correlation length of the offsets along the surface, world units
    OffsetField(const Patches& patches, double range);
    ~OffsetField();

    struct Fit {
        std::vector<double> offset;
        std::vector<double> precision;  ///< 1 / variance of the offset according to the image alone
        std::vector<double> carried;    ///< change of the offsets if `shift` is added to the prior's mean
    };
    /// @param mean, deviation  the prior, by patch
    /// @param evidence         by patch
    /// @param fixed, fixed_precision  other known offsets, such as those of marks, and their 1 / variance, by patch;
    /// precision 0: unknown
    /// @param shift  by patch, a change of the prior's mean, of which Fit::carried is the effect; null: not computed
    [[nodiscard]] Fit fit(const std::vector<double>& mean, const std::vector<double>& deviation,
                          const std::vector<OffsetEvidence>& evidence, const std::vector<double>& fixed,
                          const std::vector<double>& fixed_precision, const std::vector<double>* shift) const;

private:
    const Patches& patches_;
    std::unique_ptr<SquaredMatrix> precision_;  // precision matrix of the field with unit variance
};

/// Mean and variance of the product of a density and a normal distribution. @return the mass of the product relative to
/// that of the normal distribution.
double moments(const OffsetEvidence& evidence, double mean, double variance, double& new_mean, double& new_variance);

}  // namespace covol::guidance
