#pragma once
// Alternates between normals and the indicator function that follows from them until they agree.
#include <optional>
#include <vector>

#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// A stage of the iteration, which has one stack of grids.
struct Stage {
    double cell;     ///< cell size of the finest grid, world units
    int iterations;  ///< maximum number of updates of the normals
    bool is_last;
    double enclosed;  ///< value of the indicator above which a point counts as enclosed by another part
};

/// The iteration of Hou et al., Iterative Poisson surface reconstruction, ACM Trans. Graph. 41(4), 2022, with the
/// addition that whole patches are reversed.
class Iteration {
public:
    /// @param points, areas  must outlive the object; areas in world units squared
    Iteration(const std::vector<Vec3>& points, const std::vector<double>& areas, const RunContext& run);

    /// Performs one stage. The first one starts from result.normals or, if there are none, from normals in the
    /// direction in which the density of the points decreases; later ones start from the indicator of the stage before.
    /// @throws Error Cancelled
    void run(const Stage& stage, Orientation& result);
    /// Repairs the normals by repair_torn() and then recomputes the indicator.
    /// @param spacing  of the points, world units
    void mend(double spacing, Orientation& result);
    /// The indicator of the last stage.
    [[nodiscard]] WindingField& last() { return *last_; }

private:
    void estimate_normals(double cell, Orientation& result) const;
    void solve(WindingField& field, Orientation& result, int cycles);
    double turn(WindingField& field, Orientation& result, int cycles);
    void turn_patches(WindingField& field, Orientation& result);

    const std::vector<Vec3>& points_;
    const std::vector<double>& areas_;  // unlike Orientation::areas, not scaled with the indicator
    const RunContext& run_;
    Stage stage_{};
    std::optional<WindingField> last_;
};

/// Outward normals according to the indicator: opposite to its gradient. They are along its gradient if the indicator
/// is negative, as on an inverted part, whose inside is at -1, or above `enclosed`, as for points that another part
/// encloses.
/// @param enclosed  value of the indicator above which a point counts as enclosed
[[nodiscard]] std::vector<Vec3> normals_of(const Indicator& indicator, const std::vector<Vec3>& points,
                                           double enclosed);

}  // namespace covol::cloud
