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

/// Minimum radius, in voxels, within which a mark changes a guess, even if the change is small. For five masks with ten
/// marks each, the best and the worst of the radii 4, 8, 12 and 16 voxels differ in the Dice coefficient by 0.00,
/// 0.015, 0.035, 0.03 and 0.04, and 12 is within 0.015 of the best radius for each mask.
inline constexpr double kCorrectionVoxels = 12.0;

struct CorrectionOptions {
    /// standard deviation of a mark's position, world units, > 0; automatic: half a voxel
    std::optional<double> precision;
    /// minimum radius within which a mark changes the guess, world units, > 0; automatic: kCorrectionVoxels voxels; in
    /// segment() also at least twice the widest spacing of the image
    std::optional<double> min_radius;
};

template <>
inline constexpr auto kOptions<CorrectionOptions> =
    std::tuple{Option{"precision", &CorrectionOptions::precision, kPositive},
               Option{"guess_radius", &CorrectionOptions::min_radius, kPositiveLength, with_image(Group::ReadingMarks),
                      "minimum radius around a mark within which the guess changes",
                      "12vx, or twice the image's widest spacing; 3 times the mark's distance to the guess if the mark "
                      "lies inside, 2.2 times if outside, if that is larger"}};

struct CorrectionReport {
    /// number of marks, and number of seeds that act like marks because they lie on the wrong side of the guess or of
    /// the corrected surface
    std::size_t marks = 0, seeds = 0;
    double before_mean = 0, before_max = 0;  ///< distances of the marks to the guess, world units
    double after_mean = 0, after_max = 0;    ///< distances of the marks to the corrected surface
    /// minimum and maximum of the radii within which marks act, world units
    double min_radius = 0, largest_radius = 0;
    double depth = 0;  ///< radius of the largest ball inside the guess, world units, accurate to 8 voxels
};

/// A mask after a correction, in the geometry of the original mask.
struct CorrectedMask {
    std::vector<std::int32_t> values;  ///< i fastest
    /// numbers of voxels; reached: voxels at which GuessCorrection::shift() is not 0
    std::size_t added = 0, removed = 0, reached = 0;
};

/// A guess, corrected by marks: its new level set is s - c, where s is the guess's signed distance and c a sum of
/// smooth bumps of compact support (Wendland, Adv. Comput. Math. 4, 1995, C2) around the marks.
///
/// The radius of a bump is 3 times the distance between mark and guess for corrections inward and 2.2 times for outward
/// ones, but at least the minimum radius. Both factors exceed 2.11, the maximum slope of a bump times its radius
/// divided by its height: c is then less steep than s, and s - c stays monotone across the surface. Marks with bumps of
/// similar size are solved for together (kriging with the marks' precision as the noise), the largest bumps first;
/// marks that larger bumps already satisfy remain constraints for the smaller ones. Beyond all bumps c is exactly 0. If
/// a bump is wider than the minimum radius, its effect beyond the convex hull of guess and marks is halved, so that a
/// missing part is filled up to its marks without inflating correct parts beside it.
class GuessCorrection {
public:
    struct Data;
    COVOL_API explicit GuessCorrection(std::shared_ptr<const Data> data);
    /// c at this position, world units: the distance by which the marks move the surface outward, before the reduction
    /// beyond the convex hull. Exactly 0 beyond all bumps.
    [[nodiscard]] COVOL_API double shift(const Vec3& world) const;
    /// Signed distance of the guess; negative inside.
    [[nodiscard]] COVOL_API double guess(const Vec3& world) const;
    [[nodiscard]] COVOL_API const CorrectionReport& report() const;
    /// Applies the correction to a mask. Of the voxels whose side of the surface changes, those with value 0 that are
    /// now inside get `label`, and those with `label` that are now outside get 0; all other voxels, including those
    /// with another label, keep their value.
    /// @throws Error InvalidInput (values that are not whole numbers).
    [[nodiscard]] COVOL_API CorrectedMask apply(const Image& mask, int label, const RunContext& run = {}) const;
    /// The corrected surface as a start on the guess's lattice: a signed distance, clamped.
    [[nodiscard]] COVOL_API FloatGridPtr start(const RunContext& run = {}) const;

private:
    std::shared_ptr<const Data> data_;
};

/// A guess that redraw() has changed before marks correct it.
struct RedrawnGuess {
    FloatGridPtr u;  ///< a start, as from start_from_grid(); null, or the original guess, if it was not redrawn
    WorldBox box;    ///< outside of this box the guess is unchanged
};

/// @param guess  a start (start_from_mask() and similar): a signed distance clamped to kHalfWidthVoxels
/// @param marks  on the surface, world units
/// @param inside, outside  seeds; a seed on the wrong side moves the surface to half a voxel beyond the seed
/// @throws Error InvalidOptions, InvalidInput (no surface in the guess)
[[nodiscard]] COVOL_API GuessCorrection correct_guess(const FloatGridPtr& guess, const std::vector<Vec3>& marks,
                                                      const std::vector<Vec3>& inside, const std::vector<Vec3>& outside,
                                                      const CorrectionOptions& options = {}, const RunContext& run = {},
                                                      const RedrawnGuess& redrawn = {});

}  // namespace covol
