#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// Minimum radius, in voxels, within which a mark changes a guess, however small the change. On five masks with ten
/// marks each, the Dice coefficients at radii of 4, 8, 12 and 16 voxels differ by 0.00, 0.015, 0.035, 0.03 and 0.04,
/// and 12 is within 0.015 of the best for each mask.
inline constexpr double kCorrectionVoxels = 12.0;

struct CorrectionOptions {
    std::optional<double> precision;   ///< of the marks, world units, > 0; automatic: half a voxel
    std::optional<double> min_radius;  ///< minimum radius within which a mark changes the guess, however small the
                                       ///< change, world units, > 0; automatic: kCorrectionVoxels
};

template <>
inline constexpr auto kOptions<CorrectionOptions> =
    std::tuple{Option{"precision", &CorrectionOptions::precision, kPositive},
               Option{"guess_radius", &CorrectionOptions::min_radius, kPositiveLength, with_image(Group::ReadingMarks),
                      "minimum radius around a mark within which the guess changes",
                      "12vx, or twice the image's widest spacing; 3 times the mark's distance to the guess if the mark "
                      "lies inside, 2.2 times if outside, if that is larger"}};

struct CorrectionReport {
    std::size_t marks = 0, seeds = 0;           ///< that act: seeds only if the guess had them on the wrong side
    double before_mean = 0, before_max = 0;     ///< distances of the marks to the guess, world units
    double after_mean = 0, after_max = 0;       ///< to the corrected surface
    double min_radius = 0, largest_radius = 0;  ///< within which marks act, world units
    double depth = 0;  ///< of the guess: radius of the largest ball inside, world units, to within 8 voxels
};

/// A mask after a correction, in its own geometry.
struct CorrectedMask {
    std::vector<std::int32_t> values;                 ///< i fastest
    std::size_t added = 0, removed = 0, reached = 0;  ///< voxels; reached: those where the correction is not 0
};

/// A guess, corrected according to marks: s - c, with s the guess's signed distance and c a smooth sum of bumps of
/// compact support (Wendland, Adv. Comput. Math. 4, 1995, C2) around the marks.
///
/// The radius of a bump is 3 times the distance between mark and guess for corrections inward and 2.2 times for outward
/// ones, because s - c stays monotone across the surface if c is flatter than s (a bump's slope is at most 2.11 times
/// its height divided by its radius); it is at least the minimum radius. Marks with bumps of equal size are solved for
/// together (kriging with the marks' precision as the noise), distant ones first; marks that the larger bumps already
/// satisfy are kept as constraints for the smaller ones. Beyond all bumps c is exactly 0. If a bump is wider than the
/// minimum radius, what it adds beyond the convex hull of guess and marks is halved: a missing part is filled up to its
/// marks, and correct parts beside it are not inflated.
class GuessCorrection {
public:
    struct Data;
    COVOL_API explicit GuessCorrection(std::shared_ptr<const Data> data);
    /// c, world units: how far outward the marks move the surface there, before it is limited at the convex hull.
    /// Exactly 0 where no mark acts.
    [[nodiscard]] COVOL_API double shift(const Vec3& world) const;
    /// Signed distance of the guess; negative inside.
    [[nodiscard]] COVOL_API double guess(const Vec3& world) const;
    [[nodiscard]] COVOL_API const CorrectionReport& report() const;
    /// Voxels where c is 0, and those whose side does not change, keep their exact value. Of the others, those of value
    /// 0 that become inside get `label`, those of `label` that become outside get 0, and those of other labels do not
    /// change.
    /// @throws Error InvalidInput (values that are not whole numbers).
    [[nodiscard]] COVOL_API CorrectedMask apply(const Image& mask, int label, const RunContext& run = {}) const;
    /// The corrected surface as a start on the guess's lattice: a signed distance, clamped.
    [[nodiscard]] COVOL_API FloatGridPtr start(const RunContext& run = {}) const;

private:
    std::shared_ptr<const Data> data_;
};

/// A guess that was redrawn before marks correct it: see redraw().
struct RedrawnGuess {
    FloatGridPtr u;  ///< a start, as from start_from_grid(); null, or the guess itself, if it was not redrawn
    WorldBox box;    ///< outside of it the guess is unchanged
};

/// @param guess  a start (start_from_mask() and similar): a signed distance clamped to kHalfWidthVoxels
/// @param marks  on the surface, world units
/// @param inside, outside  seeds; those that the guess has on the wrong side move it to half a voxel beyond them
/// @throws Error InvalidOptions, InvalidInput (no surface in the guess)
[[nodiscard]] COVOL_API GuessCorrection correct_guess(const FloatGridPtr& guess, const std::vector<Vec3>& marks,
                                                      const std::vector<Vec3>& inside, const std::vector<Vec3>& outside,
                                                      const CorrectionOptions& options = {}, const RunContext& run = {},
                                                      const RedrawnGuess& redrawn = {});

}  // namespace covol
