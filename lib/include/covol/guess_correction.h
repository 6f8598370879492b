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

/// Within so many voxels a mark acts on a guess, however little it moves it. Five masks, ten marks: Dice from 4, 8, 12
/// and 16 voxels differs by 0.00, 0.015, 0.035, 0.03 and 0.04, and 12 is within 0.015 of the best of each.
inline constexpr double kCorrectionVoxels = 12.0;

struct CorrectionOptions {
    std::optional<double> precision;   ///< of the marks, world units, > 0; automatic: half a voxel
    std::optional<double> min_radius;  ///< within which a mark acts on the guess, however little it moves it, world
                                       ///< units, > 0; automatic: kCorrectionVoxels
};

template <>
inline constexpr auto kOptions<CorrectionOptions> = std::tuple{
    Option{"precision", &CorrectionOptions::precision, kPositive},
    Option{"guess_radius", &CorrectionOptions::min_radius, kPositiveLength, with_image(Group::ReadingMarks),
           "a mark acts on the guess at least so far around it",
           "12vx, or two of the image's widest spacing; 3 times its distance to the guess if it lies inside, 2.2 times "
           "outside, where that is more"}};

struct CorrectionReport {
    std::size_t marks = 0, seeds = 0;           ///< that act: seeds only where the guess had them on the wrong side
    double before_mean = 0, before_max = 0;     ///< distances of the marks to the guess, world units
    double after_mean = 0, after_max = 0;       ///< to the corrected surface
    double min_radius = 0, largest_radius = 0;  ///< within which marks act, world units
    double depth = 0;  ///< of the guess: radius of the largest ball inside, world units, to within 8 voxels
};

/// A mask after a correction, in its own geometry.
struct CorrectedMask {
    std::vector<std::int32_t> values;                 ///< i fastest
    std::size_t added = 0, removed = 0, reached = 0;  ///< voxels; reached: the correction is not 0 there
};

/// A guess, corrected where marks say so: s - c, with s the guess's signed distance and c a smooth sum of bumps of
/// compact support (Wendland, Adv. Comput. Math. 4, 1995, C2) around the marks.
///
/// The radius of a bump is 3 times the distance between mark and guess inward and 2.2 times outward, for s - c stays
/// monotone across the surface while c is flatter than s (a bump's slope is at most 2.11 of its height by its radius),
/// and not below the least one.
/// Marks of equal size are solved for together (kriging with the marks' precision as the noise), far ones first, and
/// those that the bigger bumps met hold their place under the smaller ones. Beyond all bumps c is exactly 0. Where a
/// bump is wider than the least radius, what comes in beyond the convex hull of guess and marks is halved: a part that
/// is missing is filled up to its marks, and what is right beside it is not inflated.
class GuessCorrection {
public:
    struct Data;
    COVOL_API explicit GuessCorrection(std::shared_ptr<const Data> data);
    /// c, world units: how far out the marks move the surface there, before it is held at the hull. Exactly 0 where no
    /// mark acts.
    [[nodiscard]] COVOL_API double shift(const Vec3& world) const;
    /// Of the guess; negative inside.
    [[nodiscard]] COVOL_API double guess(const Vec3& world) const;
    [[nodiscard]] COVOL_API const CorrectionReport& report() const;
    /// Voxels where c is 0, and those whose side stays the same, keep their value to the bit. Of the others those of
    /// value 0 that come in get `label`, those with `label` that go out get 0, and voxels of other labels stay.
    /// @throws Error InvalidInput (values that are no whole numbers).
    [[nodiscard]] COVOL_API CorrectedMask apply(const Image& mask, int label, const RunContext& run = {}) const;
    /// The corrected surface as a start on the guess's lattice: a signed distance, clamped.
    [[nodiscard]] COVOL_API FloatGridPtr start(const RunContext& run = {}) const;

private:
    std::shared_ptr<const Data> data_;
};

/// A guess that was redrawn before marks correct it: redraw().
struct RedrawnGuess {
    FloatGridPtr u;  ///< a start, as start_from_grid() gives it; null, or the guess itself: it was not
    WorldBox box;    ///< beyond it is the guess
};

/// @param guess  a start (start_from_mask() and its kin): a signed distance clamped to kHalfWidthVoxels
/// @param marks  on the surface, world units
/// @param inside, outside  seeds; those that the guess has on the wrong side move it to half a voxel beyond them
/// @throws Error InvalidOptions, InvalidInput (no surface in the guess)
[[nodiscard]] COVOL_API GuessCorrection correct_guess(const FloatGridPtr& guess, const std::vector<Vec3>& marks,
                                                      const std::vector<Vec3>& inside, const std::vector<Vec3>& outside,
                                                      const CorrectionOptions& options = {}, const RunContext& run = {},
                                                      const RedrawnGuess& redrawn = {});

}  // namespace covol
