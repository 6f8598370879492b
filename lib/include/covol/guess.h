#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// Standard deviation of what is uniform over a unit: of a mark's place in its voxel, where nothing else is known.
inline constexpr double kUniformDeviation = 0.3;

struct GuessOptions {
    /// Standard deviation of a mark along three directions, as world vectors (an image's axes, times a share of its
    /// spacing).
    std::array<Vec3, 3> deviation{};
    /// The largest that it may be, where marks fit each other badly; up to `deviation`: as it is said.
    double max_deviation = 0;
    std::vector<Vec3> inside, outside;  ///< places whose side is known
    /// The world's end: where the body is cut off. Marks in the cut are told from marks on the surface.
    std::optional<WorldBox> end;
    /// About where the normals point, outwards: one for each mark. Empty: nothing is known.
    std::vector<Vec3> normals;
};

template <>
inline constexpr auto kOptions<GuessOptions> =
    std::tuple{Option{"deviation", &GuessOptions::deviation},
               Option{"most_deviation", &GuessOptions::max_deviation, kNotNegative},
               Option{"inside", &GuessOptions::inside},
               Option{"outside", &GuessOptions::outside},
               Option{"end", &GuessOptions::end},
               Option{"normals", &GuessOptions::normals}};

struct GuessReport {
    std::size_t marks = 0;        ///< that hold the surface
    std::size_t cut_marks = 0;    ///< that lie in the cut, inside the body: left out
    std::size_t patches = 0;      ///< surfaces of a part of the marks; 0: one of all of them
    bool held_around = false;     ///< by itself the surface would go on beyond the marks, and not close
    std::size_t wrong_seeds = 0;  ///< places of GuessOptions that lie on the wrong side in spite of all
    std::string summary;          ///< one line for people
};

/// Whether marks can have a body between them: at least four, not all in one plane.
[[nodiscard]] COVOL_API bool can_enclose(const std::vector<Vec3>& marks);

struct Guess {
    FloatGridPtr u;           ///< a start as those of band.h: u0 clamped to +-3h, active beside the surface
    std::vector<Vec3> marks;  ///< on the surface; the others lie in the cut
    GuessReport report;
};

/// A guess of the surface from few marks: through them it bends least (variational implicit surface, see
/// lib/src/guess/variational.h). No density of marks is asked for.
/// @throws Error InvalidOptions; InvalidInput (fewer than four distinct marks, all in one plane, nothing inside the
/// domain).
[[nodiscard]] COVOL_API Guess guess_from_marks(const Domain& domain, const std::vector<Vec3>& marks,
                                               const GuessOptions& options, const RunContext& run = {});

}  // namespace covol
