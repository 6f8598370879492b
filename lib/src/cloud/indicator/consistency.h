#pragma once
// How close the indicator of normals comes to that of a solid: what tells a right orientation from a wrong one.
#include <memory>
#include <vector>

#include "cloud/poisson/winding_field.h"
#include "covol/orientation.h"
#include "points/point_cells.h"

namespace covol::cloud {

/// The winding number of a solid's border is 1/2 on it and 0 or 1 elsewhere (Xu et al., Globally consistent normal
/// orientation for point clouds by regularizing the winding-number field, ACM Trans. Graph. 42(4), 2023). Where a part
/// is turned as a whole it is -1 or 2, along the part's rim it is in between, and where two walls were taken for one
/// their points lie inside.
class Consistency {
public:
    /// @param points, areas  of all of them, world units squared; points and run outlive it
    /// @param cell   of the finest grid, world units: so fine that walls which the points tell apart do not run
    /// together
    /// @param reach  distance from a point at which nothing of it is seen in the indicator, world units
    Consistency(const std::vector<Vec3>& points, std::vector<double> areas, double cell, double reach,
                const RunContext& run);

    /// For each point how far the indicator of these normals is from 1/2 there and, as far above and below it as
    /// `reach`, from the nearer one of 0 and 1: the mean of the three squares, each at most 1/4.
    /// @param normals  in/out: only their sides are taken over; their directions become those of the indicator, so that
    /// orientations found on different cells are judged by their sides alone
    /// @throws Error Cancelled
    [[nodiscard]] std::vector<double> off(std::vector<Vec3>& normals);

    /// Takes over, patch by patch, the sides of another orientation wherever that makes them more consistent.
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

/// Each normal becomes parallel to the indicator's slope at its point, on its own side.
void take_directions(const Indicator& indicator, const std::vector<Vec3>& points, std::vector<Vec3>& normals);

}  // namespace covol::cloud
