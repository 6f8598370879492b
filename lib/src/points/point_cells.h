#pragma once
// Points sorted into cubic cells, so that all points in a box are in a few contiguous ranges. Sorting is the only cost,
// for any number of points.
#include <cstdint>
#include <vector>

#include "covol/domain.h"

namespace covol::cloud {

class PointCells {
public:
    struct Range {
        std::uint32_t begin, end;
    };

    /// @param edge  of a cell, > 0; increased if the points' box would have more than 2^20 cells along an axis. At most
    /// 2^32 - 1 points.
    PointCells(const std::vector<Vec3>& points, double edge);

    /// Sorted position -> index of the point in the input.
    [[nodiscard]] const std::vector<std::uint32_t>& order() const { return order_; }
    /// The points, sorted.
    [[nodiscard]] const std::vector<Vec3>& sorted() const { return sorted_; }
    [[nodiscard]] std::size_t cell_count() const { return starts_.size() - 1; }
    /// The sorted positions of a cell's points.
    [[nodiscard]] Range cell(std::size_t n) const { return {starts_[n], starts_[n + 1]}; }
    [[nodiscard]] double edge() const { return edge_; }

    /// Ranges of sorted positions that hold all points of the box (and others of the cells it touches); `ranges` is
    /// overwritten.
    void find(const WorldBox& box, std::vector<Range>& ranges) const;
    /// The same for the cube that extends by `reach` from the position in each direction.
    void find(const Vec3& place, double reach, std::vector<Range>& ranges) const;
    [[nodiscard]] bool any_within(const Vec3& place, double reach) const;

private:
    [[nodiscard]] std::int64_t cell_along(double x, int axis) const;
    void index_rows();

    double edge_;
    Vec3 lowest_;
    std::array<std::int64_t, 3> count_;  // cells along each axis
    std::vector<std::uint32_t> order_, starts_;
    std::vector<std::uint64_t> keys_;  // of the cells, ascending
    std::vector<std::uint32_t> rows_;  // for each row along k, its first cell in keys_; empty if most rows would be
    std::vector<Vec3> sorted_;
};

}  // namespace covol::cloud
