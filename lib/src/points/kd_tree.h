#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

inline double squared_distance(const Vec3& a, const Vec3& b) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

/// A balanced kd-tree in an array: the median of each range splits it, recursively, so that clusters do not slow it
/// down. Queries may run in parallel.
class KdTree {
public:
    explicit KdTree(std::vector<Vec3> points);
    /// Squared distance to the nearest point; infinite if there is none.
    [[nodiscard]] double nearest(const Vec3& query) const;
    /// The nearest point. @pre there is one
    [[nodiscard]] Vec3 nearest_point(const Vec3& query) const;
    /// The nearest point that is closer than `distance`; null: none is.
    [[nodiscard]] const Vec3* nearest_within(const Vec3& query, double distance) const;
    /// Squared distance from one of the points to the nearest other point.
    [[nodiscard]] double nearest_other(const Vec3& query) const;

private:
    struct Search;
    void build(std::size_t begin, std::size_t end);
    void visit(const Vec3& point, Search& search) const;
    void descend(std::size_t begin, std::size_t end, Search& search) const;

    std::vector<Vec3> points_;
    std::vector<std::uint8_t> axis_;
};

}  // namespace covol::detail
