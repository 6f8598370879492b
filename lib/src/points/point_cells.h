#pragma once
// Points sorted by cubic cells, so that all points in a box are in a few contiguous ranges. Memory depends on the
// number of points, not on the extent of their box.
#include <cstdint>
#include <vector>

#include "covol/domain.h"

namespace covol::cloud {

class PointCells {
public:
    struct Range {
        std::uint32_t begin, end;
    };

    /// @param points  at most 2^32 - 1
    /// @param edge  edge length of a cell, > 0; increased if the points' box would have more than 2^20 cells along an
    /// axis
    PointCells(const std::vector<Vec3>& points, double edge);

    /// For each position in the sorted order, the index of the point in the input.
    [[nodiscard]] const std::vector<std::uint32_t>& order() const { return order_; }
    /// The points, sorted.
    [[nodiscard]] const std::vector<Vec3>& sorted() const { return sorted_; }
    [[nodiscard]] std::size_t cell_count() const { return starts_.size() - 1; }
    /// The range of the points in the n-th cell with points, in the sorted order.
    [[nodiscard]] Range cell(std::size_t n) const { return {starts_[n], starts_[n + 1]}; }
    [[nodiscard]] double edge() const { return edge_; }

    /// Sets `ranges` to ranges of the sorted order that contain all points in the box. They also contain points outside
    /// of the box, but only in cells that overlap it.
    void find(const WorldBox& box, std::vector<Range>& ranges) const;
    /// The same for the cube around `place` with an edge of 2 `reach`.
    void find(const Vec3& place, double reach, std::vector<Range>& ranges) const;
    [[nodiscard]] bool any_within(const Vec3& place, double reach) const;

private:
    [[nodiscard]] std::int64_t cell_along(double x, int axis) const;
    void index_rows();

    double edge_;
    Vec3 lowest_;
    std::array<std::int64_t, 3> count_;  // number of cells along each axis
    std::vector<std::uint32_t> order_, starts_;
    std::vector<std::uint64_t> keys_;  // keys of the cells with points, ascending
    std::vector<std::uint32_t> rows_;  // index of the first key of each row along k; empty if there are too many rows
    std::vector<Vec3> sorted_;
};

}  // namespace covol::cloud
