#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/guess_correction.h"
#include "covol/image.h"
#include "covol/run.h"

namespace covol {

/// Places beside the marks that are known to be inside or outside of the body; world units.
struct KnownSides {
    std::vector<Vec3> inside, outside;
};

/// How good a result likely is: its Dice coefficient with the truth, in [0,1].
struct ExpectedDice {
    double value = 0;          ///< as likely too low as too high
    double low = 0, high = 0;  ///< an interval that holds the truth in 90 % of results
};

/// What infer() found. The defaults say that nothing ran.
struct InferenceReport {
    bool used = false;   ///< the result is the inferred body; false: the guess was left as it is
    std::string reason;  ///< why, in plain words
    /// What the image and the guess tell of the two sides of marks that they were not learnt from, bits: 1 is
    /// everything, 0 nothing.
    double bits = 0;
    double body_error = 0;       ///< median distance of the body to marks that it was not made from, world units
    double guess_error = 0;      ///< the same of the guess with the body's normals
    double weight_of_guess = 0;  ///< in [0,1]: of the guess in what best predicts such marks
    double agreement = 0;        ///< Dice of guess and body
    /// How far off the result lies (rms), per distance from the nearest mark, by marks that it was not made from; none
    /// if none were held out.
    std::optional<double> error_slope;
    std::size_t held_out = 0;  ///< marks that this was measured at
    /// Marks that are more likely wrong than right, as they were given; the body is made without them.
    std::vector<Vec3> wrong_marks;
    std::optional<ExpectedDice> expected;  ///< none where too few marks were held out
};

struct Inferred {
    FloatGridPtr u;  ///< a level set as start_from_level() gives, on the guess's domain; the guess's where it was kept
    std::vector<Vec3> marks;  ///< without the wrong ones
    InferenceReport report;
};

/// The body that marks and image show together, where a guess from the marks alone may be wrong.
///
/// The image's gradients are axes of the normals at the marks; what lies on both sides of the marks teaches how inside
/// and outside look; the body of least surface with these log odds, a convex problem, is global, and its normals start
/// the next round (lib/src/inference/candidate.h). Marks that were left out tell how far body and guess are to be
/// believed, and which marks are wrong: several that lie far from it whether or not they are left out. The guess is
/// kept where it agrees with the body and predicts such marks as well, within the standard error, where it does not and
/// predicts them better by two, and where the body
/// leaves many marks, or has more of the known places on the wrong side.
///
/// @param guess  level set, negative inside, on its domain's lattice
/// @param marks  world positions on the surface
/// @return does not depend on the number of threads, nor on the order of the marks
/// @throws Error InvalidInput, Cancelled.
[[nodiscard]] COVOL_API Inferred infer(const FloatGrid& guess, const std::vector<Vec3>& marks, const Image& image,
                                       const KnownSides& sides = {}, const RunContext& run = {});

/// A guess that redraw() has changed, or has not.
struct Redrawn : RedrawnGuess {
    double bits = 0;  ///< what the image tells of the sides of the guess at places that it was not learnt from
    bool used = false;
    std::string reason;  ///< why, in plain words
};

/// Redraws a guess where marks say that it is wrong: how inside and outside look is learnt from the guess where no mark
/// speaks against it, and around marks that it misses, as far as a few times what it misses them by, the body of least
/// surface with these log odds takes its place. Nothing comes that hangs on nothing, and no void.
/// @param guess  a start: a signed distance, clamped
/// @param marks  world positions on the surface
/// @throws Error Cancelled.
[[nodiscard]] COVOL_API Redrawn redraw(const FloatGridPtr& guess, const std::vector<Vec3>& marks, const Image& image,
                                       const KnownSides& sides = {}, const RunContext& run = {});

}  // namespace covol
