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

/// Standard deviation of a mark's position along an axis, as a fraction of the voxel, if nothing else is known: that of
/// a uniform distribution over the voxel, rounded.
inline constexpr double kUniformDeviation = 0.3;

struct GuessOptions {
    /// Standard deviation of a mark's position along three directions, as vectors in world units (for an image, its
    /// axes multiplied by a fraction of the spacing).
    std::array<Vec3, 3> deviation{};
    /// Maximum length, in world units, to which the longest vector of `deviation` may be raised if the marks are
    /// inconsistent; the deviation is not raised if this is at most its stated length.
    double max_deviation = 0;
    std::vector<Vec3> inside, outside;  ///< positions whose side is known
    /// The box at which the body is cut off. Marks on its faces that lie inside the section of the body only show that
    /// the body is cut there; they are not used as marks on its surface.
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
    std::size_t marks = 0;      ///< number of marks that determine the surface
    std::size_t cut_marks = 0;  ///< number of marks that were not used because they lie on a cut face, inside the body
    /// number of overlapping surfaces, each through a subset of the marks, of which the surface is composed; 0: one
    /// surface passes through all marks
    std::size_t patches = 0;
    /// whether additional constraints on an ellipsoid around the marks close the surface, because it would otherwise
    /// extend far beyond the marks
    bool held_around = false;
    /// number of positions in GuessOptions::inside and outside that lie on the wrong side of the result
    std::size_t wrong_seeds = 0;
    std::string summary;  ///< one line for the user
};

/// Whether marks can enclose a body: at least four, not all in one plane. Small parts that are more than about 10,000
/// times their size apart count as marks in one plane.
[[nodiscard]] COVOL_API bool can_enclose(const std::vector<Vec3>& marks);

struct Guess {
    FloatGridPtr u;           ///< a start: signed distance clamped to +-3h, h the voxel size; active near the surface
    std::vector<Vec3> marks;  ///< the marks that determine the surface, without those on a cut face
    GuessReport report;
};

/// The guess from few marks: the surface of minimum bending energy through them (variational implicit surface, see
/// lib/src/guess/variational.h). The marks need not be dense.
/// @throws Error InvalidOptions; InvalidInput (fewer than four distinct marks, all marks in one plane, no surface in
/// the domain).
[[nodiscard]] COVOL_API Guess guess_from_marks(const Domain& domain, const std::vector<Vec3>& marks,
                                               const GuessOptions& options, const RunContext& run = {});

}  // namespace covol
