#pragma once
#include <optional>
#include <vector>

#include "covol/domain.h"
#include "guidance/border_profile.h"
#include "guidance/offset_field.h"
#include "guidance/patches.h"
#include "guidance/smooth_image.h"

namespace covol::guidance {

/// The image's profiles along the normals of a surface.
struct Scene {
    const Patches& patches;
    const FloatGrid& distance;  ///< to the surface, signed, in a wide band
    const Domain& domain;
    const std::vector<int>& ranges;  ///< by patch: range in which the border is searched, steps
    Vec3 shift{0, 0, 0};             ///< from positions on the surface to positions in the image
};

/// The marks in one patch.
struct PatchMark {
    std::size_t patch = 0;
    Vec3 at{};             ///< mean position of the marks
    double residual = 0;   ///< their mean distance from the surface, positive outside
    double deviation = 0;  ///< standard deviation of their mean position along the normal
};

/// Reliability of the image.
struct Trust {
    double sharpness = 0;  ///< exponent of the likelihood, at most 1, because neighbouring samples are not independent
    double stray = 1;      ///< fraction of places at which the image does not follow the profile
};

/// The image's profiles at the marks, and how well they predict the marks.
class LearntProfile {
public:
    /// @param guess_deviation  standard deviation of the surface at the marks
    /// @param prior_deviation  standard deviation of the surface elsewhere, which is also assumed when a held-out mark
    /// is predicted
    /// @param apart            marks closer together than this are left out together
    LearntProfile(const Scene& scene, const std::vector<PatchMark>& marks, const SmoothImage& image,
                  double guess_deviation, double prior_deviation, double apart);

    /// Mean increase of the log density at held-out marks due to the image.
    [[nodiscard]] double gain() const { return gain_; }
    /// The gain minus its standard error.
    [[nodiscard]] double sure_gain() const { return gain_ - gain_error_; }
    [[nodiscard]] bool local() const { return local_; }

    struct ProfileEvidence {
        OffsetEvidence all;       ///< learnt at all marks
        OffsetEvidence held_out;  ///< learnt without the nearest mark and the marks close to it
        std::size_t nearest = 0;  ///< index of the nearest mark
    };
    [[nodiscard]] ProfileEvidence query(const Scene& scene, std::size_t patch, const SmoothImage& image) const;

    /// Median intensity over all marks, this many steps outward of the border.
    [[nodiscard]] double brightness(int steps) const;

private:
    void test(const Scene& scene, const std::vector<PatchMark>& marks, double prior_deviation, double apart,
              bool local);

    BorderProfile profile_;
    // tables_ contains one table for each place, or a single one if not local_; held_out_ contains for each place a
    // table that was learnt without it.
    std::vector<BorderTable> tables_, held_out_;
    // Standard deviation of the Gaussian by which marks are weighted with their distance, if the profile varies with
    // the position.
    double radius_ = 0;
    bool local_ = false;
    Trust trust_;
    double gain_ = 0, gain_error_ = 0;
};

/// Reads the profile of a patch up to `reach` steps on both sides, but only within the image and only while no other
/// part of the surface is closer.
[[nodiscard]] PatchProfile read_profile(const Scene& scene, std::size_t patch, int reach, const SmoothImage& image);

}  // namespace covol::guidance
