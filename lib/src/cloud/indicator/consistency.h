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
    /// @param points, areas  all of them, world units squared; points and run must outlive the object
    /// @param cell   of the finest grid, world units: fine enough to separate walls that the points separate
    /// @param reach  distance from a point beyond which its own effect on the indicator is negligible, world units
    Consistency(const std::vector<Vec3>& points, std::vector<double> areas, double cell, double reach,
                const RunContext& run);

    /// For each point the mean of three squared deviations, each at most 1/4: of the indicator of these normals from
    /// 1/2 at the point, and from the nearer of 0 and 1 at the distance `reach` above and below it.
    /// @param normals  in/out: only their sides are used; their directions become those of the indicator, so that
    /// orientations found with different cells are compared by their sides alone
    /// @throws Error Cancelled
    [[nodiscard]] std::vector<double> off(std::vector<Vec3>& normals);

    /// Adopts the sides of another orientation for each patch that becomes more consistent by it.
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
