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

/// Standard deviation of a uniform distribution over a unit: of a mark's position in its voxel, if nothing else is
/// known.
inline constexpr double kUniformDeviation = 0.3;

struct GuessOptions {
    /// Standard deviation of a mark along three directions, as world vectors (an image's axes times a fraction of its
    /// spacing).
    std::array<Vec3, 3> deviation{};
    /// Maximum to which the deviation may be raised if the marks are inconsistent; up to `deviation`: it is not raised.
    double max_deviation = 0;
    std::vector<Vec3> inside, outside;  ///< positions whose side is known
    /// The box at which the body is cut off. Marks in the cut are distinguished from marks on the surface.
    std::optional<WorldBox> end;
    /// Approximate outward normals, one for each mark. Empty: unknown.
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
    std::size_t marks = 0;        ///< that determine the surface
    std::size_t cut_marks = 0;    ///< that lie in the cut, inside the body: not used
    std::size_t patches = 0;      ///< surfaces through subsets of the marks; 0: one surface through all of them
    bool held_around = false;     ///< the unconstrained surface would extend beyond the marks and not close
    std::size_t wrong_seeds = 0;  ///< positions of GuessOptions that still lie on the wrong side
    std::string summary;          ///< one line for the user
};

/// Whether marks can enclose a body: at least four, not all in one plane.
[[nodiscard]] COVOL_API bool can_enclose(const std::vector<Vec3>& marks);

struct Guess {
    FloatGridPtr u;           ///< a start like those of band.h: u0 clamped to +-3h, active near the surface
    std::vector<Vec3> marks;  ///< those on the surface; the others lie in the cut
    GuessReport report;
};

/// A guess of the surface from few marks: the surface of minimum bending energy through them (variational implicit
/// surface, see lib/src/guess/variational.h). The marks need not be dense.
/// @throws Error InvalidOptions; InvalidInput (fewer than four distinct marks, all in one plane, nothing inside the
/// domain).
[[nodiscard]] COVOL_API Guess guess_from_marks(const Domain& domain, const std::vector<Vec3>& marks,
                                               const GuessOptions& options, const RunContext& run = {});

}  // namespace covol
