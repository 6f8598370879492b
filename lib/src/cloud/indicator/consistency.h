#pragma once
// Measures how close the indicator of given normals is to that of a solid, which distinguishes a right orientation from
// a wrong one.
#include <memory>
#include <vector>

#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"
#include "points/point_cells.h"

namespace covol::cloud {

/// Measures how far the winding number of oriented points is from that of a solid, which is 1/2 on the solid's border
/// and 0 or 1 elsewhere (Xu et al., Globally consistent normal orientation for point clouds by regularizing the
/// winding-number field, ACM Trans. Graph. 42(4), 2023). If all normals of a part are reversed, the winding number is
/// -1 or 2 in that part, with intermediate values along the part's rim. If two walls were mistaken for one, their
/// points lie inside the solid, where the winding number is not 1/2.
class Consistency {
public:
    /// @param points, areas  all points, and their areas in world units squared; points and run must outlive the object
    /// @param cell   cell size of the finest grid, world units: small enough to separate walls that are separate in the
    /// points
    /// @param reach  distance from a point beyond which its own effect on the indicator is negligible, world units
    Consistency(const std::vector<Vec3>& points, std::vector<double> areas, double cell, double reach,
                const RunContext& run);

    /// For each point, the mean of three squared deviations of the indicator of these normals, each at most 1/4: from
    /// 1/2 at the point, and from the nearer of 0 and 1 at the two positions at the distance `reach` along the normal.
    /// @param normals  in/out: only their sides are used; their directions become those of the indicator, so that
    /// orientations found with different cells are compared by their sides alone
    /// @throws Error Cancelled
    [[nodiscard]] std::vector<double> off(std::vector<Vec3>& normals);

    /// Adopts the normals of another orientation in those patches that become more consistent with them, if the sum of
    /// all deviations decreases. A patch is a set of connected cells in which most normals of the two orientations are
    /// opposite.
    /// @param own      normals; in/out
    /// @param own_off  off(own); in/out
    void take_better(const std::vector<Vec3>& other, std::vector<Vec3>& own, std::vector<double>& own_off);

private:
    void solve(const std::vector<Vec3>& normals);

    const std::vector<Vec3>& points_;
    std::vector<double> areas_;
    double reach_;
    const RunContext& run_;
    WindingField field_;
    bool is_solved_ = false;
    PointCells cells_;
    std::vector<std::vector<std::uint32_t>> beside_;
};

/// Makes each normal parallel to the indicator's gradient at its point without changing its side.
void take_directions(const Indicator& indicator, const std::vector<Vec3>& points, std::vector<Vec3>& normals);

}  // namespace covol::cloud
