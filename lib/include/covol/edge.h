#pragma once
#include <string>

#include "covol/domain.h"
#include "covol/image.h"
#include "covol/run.h"

namespace covol {

struct EdgeOptions {
    double sigma = -1.0;              ///< σ >= 0, world units: presmoothing; < 0 picks 1 voxel.
    double edge_k = 0.0;              ///< K > 0 in g = 1/(1+K s^2), s per world unit of the normalised image; 0: see edge_contrast.
    double edge_contrast = 0.0;       ///< s at which g = 1/2, i.e. K = 1/s^2; 0 picks a high percentile of s in the band.
    double contrast_percentile = 0.9; ///< that percentile, in (0,1)
    double low = 0.0, high = 0.0;     ///< intensities mapped to 0 and 1; equal: the image's 0.5 % and 99.5 % percentiles.
    [[nodiscard]] std::string why_invalid() const;
};

struct EdgeReport {
    double sigma = 0;           ///< world units
    double edge_k = 0;          ///< K as used
    double edge_contrast = 0;   ///< 1/sqrt(K)
    double low = 0, high = 0;   ///< as used
};

struct EdgeResult {
    FloatGridPtr grid;  ///< "edge": g in (0,1], active where the topology is, background 1
    EdgeReport report;
};

/// Edge detector g = 1/(1 + K |∇G_σ * I|^2), Eq. (2), on the active voxels of `topology`.
/// The image is sampled there and in a halo, normalised, smoothed by the implicit heat equation over time σ²/2, and
/// |∇I| is the mean over the 24 tetrahedra of each voxel.
/// @throws Error InvalidOptions, InvalidInput (no active voxel; the image is constant).
[[nodiscard]] EdgeResult edge(const Image& image, const FloatGrid& topology, const EdgeOptions& options = {},
                              const RunContext& run = {});

}  // namespace covol
