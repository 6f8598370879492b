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

/// Positions beside the marks that are known to be inside or outside of the body; world units.
struct KnownSides {
    std::vector<Vec3> inside, outside;
};

/// How good a result probably is: its Dice coefficient with the truth, in [0,1].
struct ExpectedDice {
    double value = 0;          ///< median: equally likely too low or too high
    double low = 0, high = 0;  ///< interval that contains the truth for 90 % of results
};

/// What infer() found. The defaults mean that nothing ran.
struct InferenceReport {
    bool used = false;   ///< the result is the inferred body; false: the guess was kept
    std::string reason;  ///< why, as a message for the user
    /// Information that image and guess give about the two sides of marks that were not used for learning, bits: 1 is
    /// everything, 0 nothing.
    double bits = 0;
    double body_error = 0;       ///< median distance of the body from marks that were held out, world units
    double guess_error = 0;      ///< the same for the guess with the body's normals
    double weight_of_guess = 0;  ///< in [0,1]: weight of the guess in the combination that best predicts such marks
    double agreement = 0;        ///< Dice of guess and body
    /// Error of the result (rms) per distance from the nearest mark, measured at marks that were held out; none if
    /// there were none.
    std::optional<double> error_slope;
    std::size_t held_out = 0;  ///< number of held-out marks used for these measurements
    /// Marks that are more likely wrong than right, as they were given; the body is made without them.
    std::vector<Vec3> wrong_marks;
    std::optional<ExpectedDice> expected;  ///< none if too few marks were held out
};

struct Inferred {
    /// a level set as from start_from_level(), on the guess's domain; that of the guess if it was kept
    FloatGridPtr u;
    std::vector<Vec3> marks;  ///< without the wrong ones
    InferenceReport report;
};

/// The body that marks and image indicate together, for cases in which a guess from the marks alone may be wrong.
///
/// The image's gradients give the axes of the normals at the marks; the appearance of inside and outside is learnt on
/// both sides of the marks; the body of minimum surface with these log odds is the global optimum of a convex problem,
/// and its normals start the next round (lib/src/inference/candidate.h). Held-out marks determine how reliable body and
/// guess are, and which marks are wrong: several that lie far from it whether or not they are held out. The guess is
/// kept if it agrees with the body and predicts held-out marks equally well, within the standard error; if it does not
/// agree and predicts them better by two standard errors; and if the body misses many marks, or has more of the known
/// positions on the wrong side.
///
/// @param guess  level set, negative inside, on its domain's lattice
/// @param marks  world positions on the surface
/// @return does not depend on the number of threads, nor on the order of the marks
/// @throws Error InvalidInput, Cancelled.
[[nodiscard]] COVOL_API Inferred infer(const FloatGrid& guess, const std::vector<Vec3>& marks, const Image& image,
                                       const KnownSides& sides = {}, const RunContext& run = {});

/// A guess that redraw() may have changed.
struct Redrawn : RedrawnGuess {
    double bits = 0;  ///< information that the image gives about the sides of the guess, at positions that were not
                      ///< used for learning
    bool used = false;
    std::string reason;  ///< why, as a message for the user
};

/// Redraws a guess where marks indicate that it is wrong. The appearance of inside and outside is learnt from the guess
/// where no mark contradicts it; around marks that it misses, within a few times the distance by which it misses them,
/// it is replaced by the body of minimum surface with these log odds. No unconnected pieces and no voids are added.
/// @param guess  a start: a signed distance, clamped
/// @param marks  world positions on the surface
/// @throws Error Cancelled.
[[nodiscard]] COVOL_API Redrawn redraw(const FloatGridPtr& guess, const std::vector<Vec3>& marks, const Image& image,
                                       const KnownSides& sides = {}, const RunContext& run = {});

}  // namespace covol
