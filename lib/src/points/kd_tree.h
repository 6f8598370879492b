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

/// A balanced kd-tree in an array: each range is split at its median, recursively, so that the depth is the same for
/// clustered points. Queries may run in parallel.
class KdTree {
public:
    explicit KdTree(std::vector<Vec3> points);
    /// Squared distance to the nearest point; infinite if there is none.
    [[nodiscard]] double nearest(const Vec3& query) const;
    /// The nearest point. @pre the tree is not empty
    [[nodiscard]] Vec3 nearest_point(const Vec3& query) const;
    /// The nearest point if it is closer than `distance`, otherwise null.
    [[nodiscard]] const Vec3* nearest_within(const Vec3& query, double distance) const;
    /// Squared distance from `query`, which is one of the points, to the nearest other one; infinite if there is none.
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
