#pragma once
// Normals and the indicator function that they make, in turn, until they agree.
#include <optional>
#include <vector>

#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// A stack of grids and what is done on it.
struct Stage {
    double cell;     ///< of the finest, world units
    int iterations;  ///< at most
    bool is_last;
    double enclosed;  ///< the indicator from which on a point counts as enclosed by another part
};

/// Hou et al., Iterative Poisson surface reconstruction, ACM Trans. Graph. 41(4), 2022, with patches that are turned as
/// a whole.
class Iteration {
public:
    /// @param points, areas  which outlive it; areas in world units squared
    /// @param first_guess  [cells of the first stage] of the grid of the density that gives the first normals
    Iteration(const std::vector<Vec3>& points, const std::vector<double>& areas, double first_guess,
              const RunContext& run);

    /// @throws Error Cancelled
    void run(const Stage& stage, Orientation& result);
    /// @param spacing  of the points, world units
    void mend(double spacing, Orientation& result);
    /// The indicator as the last stage left it.
    [[nodiscard]] WindingField& last() { return *last_; }

private:
    void guess_normals(double cell, Orientation& result) const;
    void solve(WindingField& field, Orientation& result, int cycles);
    double turn(WindingField& field, Orientation& result, int cycles);
    void turn_patches(WindingField& field, Orientation& result);

    const std::vector<Vec3>& points_;
    const std::vector<double>& areas_;  // before the indicator's step scales them
    double first_guess_;
    const RunContext& run_;
    Stage stage_{};
    std::optional<WindingField> last_;
};

/// Outward, by the indicator: down its slope where it is between outside and inside, up where another part encloses the
/// point.
/// @param enclosed  the indicator from which on it does
[[nodiscard]] std::vector<Vec3> normals_of(const Indicator& indicator, const std::vector<Vec3>& points,
                                           double enclosed);

}  // namespace covol::cloud
