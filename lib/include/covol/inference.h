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

/// Positions, in addition to the marks, that are known to be inside or outside of the body; world units.
struct KnownSides {
    std::vector<Vec3> inside, outside;
};

/// Prediction of the Dice coefficient between a result and the truth, in [0,1].
struct ExpectedDice {
    double value = 0;          ///< median of the prediction
    double low = 0, high = 0;  ///< interval that contains the true coefficient for 90 % of the results
};

/// What infer() found. The default values mean that infer() was not called.
struct InferenceReport {
    bool used = false;   ///< the result is the inferred body; false: the guess was kept
    std::string reason;  ///< why the body was used or not, as a message for the user
    /// Information that image and guess give about the two sides of held-out marks, in bits: 1 if they determine the
    /// sides, 0 if they give no information.
    double bits = 0;
    double body_error = 0;  ///< median distance of the body from held-out marks, world units
    /// median distance, from held-out marks, of the surface of minimum bending energy that has the normals of the body
    /// at the marks; world units
    double guess_error = 0;
    /// in [0,1]: weight of the surface of minimum bending energy in its weighted mean with the body; chosen so that
    /// this mean predicts the held-out marks best
    double weight_of_guess = 0;
    double agreement = 0;  ///< Dice coefficient of guess and body
    /// Root mean square error of the result divided by the distance from the nearest mark, measured at held-out marks;
    /// none if no body was found.
    std::optional<double> error_slope;
    std::size_t held_out = 0;  ///< number of held-out marks used for these measurements
    /// Marks that are probably wrong, with their original positions; the body is computed without them.
    std::vector<Vec3> wrong_marks;
    /// none if there were too few held-out marks, or if the body was rejected because it misses many marks
    std::optional<ExpectedDice> expected;
};

struct Inferred {
    /// the level set of the body, as from start_from_level(), on the guess's domain; a copy of the guess if it was kept
    FloatGridPtr u;
    std::vector<Vec3> marks;  ///< the given marks without the wrong ones
    InferenceReport report;
};

/// Computes the body from marks and image together, for cases in which a guess from the marks alone may be wrong.
///
/// The image's gradients give the normals at the marks up to their signs; the appearance of inside and outside is
/// estimated on both sides of the marks. The body of minimum surface with the resulting log odds is the global optimum
/// of a convex problem; its normals are used in the next round (lib/src/inference/candidate.h). Held-out marks show how
/// reliable body and guess are. Marks count as wrong if there are several that are far from the body whether or not
/// they are held out. The guess is kept in these cases: it agrees with the body and predicts held-out marks as well as
/// the body, within one standard error; it does not agree, but predicts them better by two standard errors; the body
/// misses many marks; the body has more of the known positions on the wrong side.
///
/// @param guess  level set, negative inside, on its domain's lattice
/// @param marks  world positions on the surface
/// @return the result, which depends neither on the number of threads nor on the order of the marks
/// @throws Error InvalidInput, Cancelled.
[[nodiscard]] COVOL_API Inferred infer(const FloatGrid& guess, const std::vector<Vec3>& marks, const Image& image,
                                       const KnownSides& sides = {}, const RunContext& run = {});

/// A guess that redraw() may have changed.
struct Redrawn : RedrawnGuess {
    double bits = 0;     ///< information that the image gives about the sides of the guess, at held-out positions
    bool used = false;   ///< the guess was changed
    std::string reason;  ///< why it was changed or not, as a message for the user
};

/// Redraws the parts of a guess that are wrong according to the marks. The appearance of inside and outside is
/// estimated from the parts of the guess that no mark contradicts. Around each mark that the guess misses, within a few
/// times the distance between both, the guess is replaced by the body of minimum surface with the log odds that follow
/// from this appearance. No unconnected pieces or voids are added.
/// @param guess  a start: a signed distance, clamped
/// @param marks  world positions on the surface
/// @throws Error Cancelled.
[[nodiscard]] COVOL_API Redrawn redraw(const FloatGridPtr& guess, const std::vector<Vec3>& marks, const Image& image,
                                       const KnownSides& sides = {}, const RunContext& run = {});

}  // namespace covol
