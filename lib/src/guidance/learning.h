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
    const std::vector<int>& ranges;  ///< by patch: how far the border is looked for, steps
    Vec3 shift{0, 0, 0};             ///< of the image's places against the surface's
};

/// The marks in one patch.
struct PatchMark {
    std::size_t patch = 0;
    Vec3 at{};             ///< their mean
    double residual = 0;   ///< from the surface to them, outward
    double deviation = 0;  ///< of their own error along the normal
};

/// How far the image is believed.
struct Trust {
    double sharpness = 0;  ///< exponent of the likelihood: neighbouring samples are no independent ones
    double stray = 1;      ///< share of places where the image does not follow the profile
};

/// What the image has at the marks, and how well it foretells them.
class Lesson {
public:
    /// @param guess_deviation  of the surface at the marks
    /// @param prior_deviation  of the surface anywhere: marks are foretold as if they lay at any other place
    /// @param apart            marks nearer than this share what they have learnt
    Lesson(const Scene& scene, const std::vector<PatchMark>& marks, const SmoothImage& image, double guess_deviation,
           double prior_deviation, double apart);

    [[nodiscard]] double gain() const { return gain_; }
    /// Less its own standard error.
    [[nodiscard]] double sure_gain() const { return gain_ - gain_error_; }
    [[nodiscard]] bool local() const { return local_; }

    struct Answer {
        OffsetEvidence all;       ///< learnt at all marks
        OffsetEvidence held_out;  ///< learnt without the nearest mark and those beside it
        std::size_t nearest = 0;  ///< mark
    };
    [[nodiscard]] Answer query(const Scene& scene, std::size_t patch, const SmoothImage& image) const;

    /// Median brightness at the marks so many steps outward.
    [[nodiscard]] double brightness(int steps) const;

private:
    void test(const Scene& scene, const std::vector<PatchMark>& marks, double prior_deviation, double apart,
              bool local);

    BorderProfile profile_;
    std::vector<BorderTable> tables_, held_out_;  // by place, or one for all; by place
    double radius_ = 0;                           // in which a local profile is learnt
    bool local_ = false;
    Trust trust_;
    double gain_ = 0, gain_error_ = 0;
};

/// Reads the profile of a patch as far as its surface is the nearest one and the image reaches.
[[nodiscard]] PatchProfile read_profile(const Scene& scene, std::size_t patch, int reach, const SmoothImage& image);

}  // namespace covol::guidance
