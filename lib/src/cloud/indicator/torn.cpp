#include "cloud/indicator/torn.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/disjoint_sets.h"
#include "base/geometry.h"
#include "base/heuristics.h"
#include "cloud/indicator/heuristics.h"
#include "points/heuristics.h"
#include "points/neighbours.h"
#include "points/point_cells.h"

namespace covol::cloud {
namespace {

constexpr std::size_t kNeighbours = 12;

/// The sheet at each point, and the neighbouring points on the same sheet.
class Sheets {
public:
    Sheets(const std::vector<Vec3>& points, double spacing) : axes_(points.size()), beside_(points.size()) {
        const PointCells cells(points, kNear.first_radius * spacing);
        for_nearest(cells, spacing, kNeighbours, [&](std::uint32_t point, const std::vector<Neighbour>& near) {
            for (std::size_t n = 0; n < kNeighbours; ++n)
                beside_[point][n] = n < near.size() ? cells.order()[near[n].at] : point;
            if (near.size() < kNeighbours) return;
            const auto [sum, squares] = moments_of(cells, points[point], near);
            const double count = double(near.size()) + 1;  // 1: the point itself
            const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> shape(squares / count -
                                                                       sum * sum.transpose() / (count * count));
            if (shape.eigenvalues()[0] > kCloud.flat * kCloud.flat * shape.eigenvalues()[1]) return;
            const Eigen::Vector3d axis = shape.eigenvectors().col(0);
            axes_[point] = {axis[0], axis[1], axis[2]};
        });
    }

    [[nodiscard]] std::size_t size() const { return axes_.size(); }
    /// The sheet's normal, of either sign; 0 if there is no sheet.
    [[nodiscard]] const Vec3& axis(std::size_t n) const { return axes_[n]; }
    /// Calls visit(neighbour) for the neighbours on the same sheet.
    template <typename Visit>
    void for_beside(std::size_t n, Visit visit) const {
        for (const std::uint32_t other : beside_[n])
            if (other != n && std::abs(dot(axes_[n], axes_[other])) > kCloud.same_sheet) visit(other);
    }

private:
    std::vector<Vec3> axes_;
    std::vector<std::array<std::uint32_t, kNeighbours>> beside_;
};

/// Replaces each normal that differs by more than 60 degrees from both normals of its sheet by one of these two, on the
/// side of the neighbours' normals. @return number of replaced normals
std::size_t set_upright(const Sheets& sheets, std::vector<Vec3>& normals) {
    std::vector<char> is_lying(sheets.size(), 0);
    std::vector<std::uint32_t> lying;
    for (std::uint32_t n = 0; n < sheets.size(); ++n) {
        const double squared = dot(sheets.axis(n), sheets.axis(n));
        if (!(squared > 0) || std::abs(dot(sheets.axis(n), normals[n])) >= kCommon.turn) continue;
        is_lying[n] = 1;
        lying.push_back(n);
    }
    const std::size_t all = lying.size();
    // Each round replaces the normals of points for which the side is known at no fewer than half of the neighbours on
    // their sheet.
    for (std::size_t before = all + 1; !lying.empty() && lying.size() < before;) {
        before = lying.size();
        std::vector<std::pair<std::uint32_t, Vec3>> mended;
        for (const std::uint32_t n : lying) {
            int known = 0, unknown = 0;
            double side = 0;
            sheets.for_beside(n, [&](std::uint32_t other) {
                ++(is_lying[other] ? unknown : known);
                if (!is_lying[other]) side += dot(normals[other], sheets.axis(n));
            });
            if (known > 0 && known >= unknown) mended.emplace_back(n, times(side < 0 ? -1.0 : 1.0, sheets.axis(n)));
        }
        for (const auto& [n, normal] : mended) {
            normals[n] = normal;
            is_lying[n] = 0;
        }
        std::erase_if(lying, [&](std::uint32_t n) { return !is_lying[n]; });
    }
    return all - lying.size();
}

/// Reverses the smaller one of two parts of a sheet with opposite normals. @return how many normals were reversed
std::size_t turn_smaller(const Sheets& sheets, std::vector<Vec3>& normals) {
    detail::DisjointSets parts(sheets.size());  // points connected by consistent normals
    // Normals are compared by their sides of the sheet, because gradually tilting normals could otherwise connect two
    // parts with opposite normals.
    const auto side = [&](std::uint32_t n) { return dot(sheets.axis(n), normals[n]); };
    const auto meets = [&](std::uint32_t n, std::uint32_t other) {
        return side(n) * side(other) * dot(sheets.axis(n), sheets.axis(other));
    };
    for (std::uint32_t n = 0; n < sheets.size(); ++n)
        sheets.for_beside(n, [&](std::uint32_t other) {
            if (meets(n, other) > 0) parts.unite(n, other);
        });
    std::vector<std::size_t> size(sheets.size(), 0);
    for (std::uint32_t n = 0; n < sheets.size(); ++n) ++size[parts.root(n)];
    // For each pair of parts, the number of neighbouring points with opposite normals.
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> seams;
    for (std::uint32_t n = 0; n < sheets.size(); ++n)
        sheets.for_beside(n, [&](std::uint32_t other) {
            if (const auto a = parts.root(n), b = parts.root(other); a != b && meets(n, other) < 0) ++seams[{a, b}];
        });
    // Each part is reversed to agree with the larger part to which it has the longest seam.
    std::map<std::uint32_t, std::pair<std::size_t, std::uint32_t>> turned;
    for (const auto& [pair, count] : seams) {
        const auto [a, b] = pair;
        if (size[a] < size[b] && count > turned[a].first) turned[a] = {count, b};
    }
    std::erase_if(turned, [](const auto& t) { return t.second.first == 0; });
    std::size_t count = 0;
    for (std::uint32_t n = 0; n < sheets.size(); ++n) {
        // The larger part may itself be reversed to agree with a still larger one; two reversals cancel out.
        int times_turned = 0;
        for (auto at = turned.find(parts.root(n)); at != turned.end(); at = turned.find(at->second.second))
            ++times_turned;
        if (times_turned % 2 == 0) continue;
        normals[n] = times(-1, normals[n]);
        ++count;
    }
    return count;
}

}  // namespace

std::size_t repair_torn(const std::vector<Vec3>& points, double spacing, std::vector<Vec3>& normals) {
    if (points.size() <= kNeighbours) return 0;
    const Sheets sheets(points, spacing);
    const std::size_t upright = set_upright(sheets, normals);
    return upright + turn_smaller(sheets, normals);
}

}  // namespace covol::cloud
