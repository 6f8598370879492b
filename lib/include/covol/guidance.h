#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "covol/edge.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/run.h"

namespace covol {

/// What changes the result of guide(); lengths in world units.
struct GuidanceOptions {
    double mark_precision = -1;  ///< a mark lies within half of this of the border it means, along each axis; < 0: one voxel of the image
    double range = -1;           ///< how far from the guess the border may be looked for; < 0: by the distance to the marks
    double weight = 1;           ///< in [0,1]: share of the image's word that counts; 0 leaves the guess as it is
    EdgeFeature feature = EdgeFeature::Automatic;  ///< what the report expects at the marks; the profile is learnt in any case
    /// Empty when usable, else one line for each bad field.
    [[nodiscard]] std::string why_invalid() const;
};

/// What guide() saw and did. The defaults say that nothing ran.
struct GuidanceReport {
    bool used = false;          ///< the image had a say
    std::string reason;         ///< why it had none, in plain words
    MarkedFeature feature;      ///< what the image has at the marks
    double inside = 0, border = 0, outside = 0;  ///< median intensities 2 voxels inside, at, and 2 voxels outside the marks
    double sigma = 0;           ///< presmoothing, the one that foretold the marks best
    bool local = false;         ///< the profile varies with the place
    double gain = 0;            ///< mean gain of log-likelihood of a mark that the rest of them foretells by the image, nats
    double image_error = 0;     ///< how far off the marks the image alone would put the border (rms)
    double guess_error = 0;     ///< how far the image finds the guess off between the marks (rms)
    double confident_share = 0; ///< of the area, where the image moved or held the surface rather than the guess
    double mean_offset = 0;     ///< signed, outward > 0, by area
    double max_offset = 0;      ///< largest |offset|
};

/// Moves a guess to where the image shows, between the marks, the border that it shows at the marks.
///
/// The profile of the image along the surface's normals is learnt at the marks (how often each brightness occurs at each
/// depth); elsewhere each offset along the normal has a likelihood under it, and a smooth field of offsets that stays
/// near the guess, by the distance to the marks, weighs them. How much the image is believed is measured at marks that
/// it has not been learnt from; an image that does not foretell them leaves the guess as it is.
///
/// @param guess  level set, negative inside, on the domain's lattice
/// @param marks  world positions
/// @return a level set as start_from_grid() gives, on the guess's domain. Does not depend on the number of threads.
/// @throws Error InvalidOptions, InvalidInput (no surface; no image voxel near it), Cancelled.
[[nodiscard]] FloatGridPtr guide(const FloatGrid& guess, const std::vector<Vec3>& marks, const Image& image,
                                 const GuidanceOptions& options, GuidanceReport& report, const RunContext& run = {});

}  // namespace covol
