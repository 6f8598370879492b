#pragma once
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "covol/error.h"
#include "covol/image.h"
#include "covol/mesh.h"

namespace covol::meshing {

/// Determines which voxel centres lie inside a closed mesh, by winding numbers along the lattice's rows.
///
/// Rows that meet an edge or a corner are shifted by an infinitesimal step (Edelsbrunner and Mücke 1990), so that the
/// number of crossings of each closed surface is consistent.
class MeshRows {
public:
    MeshRows(const TriangleMesh& mesh, const ImageGeometry& lattice)
        : mesh_(mesh), triangles_of_(lattice.size[2] + 1, 0) {
        for (std::size_t v = 0; v < mesh.vertices.size(); ++v) points_.push_back(lattice.world_to_index(mesh.place(v)));
        // Sorts the triangles by slices. A triangle that reaches several slices occurs in each of them.
        for_each_slice(lattice.size[2], [&](std::uint32_t, int k) { ++triangles_of_[k + 1]; });
        std::partial_sum(triangles_of_.begin(), triangles_of_.end(), triangles_of_.begin());
        order_.resize(triangles_of_.back());
        auto next = triangles_of_;
        for_each_slice(lattice.size[2], [&](std::uint32_t t, int k) { order_[next[k]++] = t; });
    }

    /// Fills `out` with the slices [first, first + size[2]) of the lattice, i fastest: 1 inside, 0 outside.
    /// @throws Error InvalidInput with the message `not_closed` if the mesh is not closed.
    void fill(int first, const Index3& size, std::vector<std::uint8_t>& out, const std::string& not_closed) const {
        std::fill(out.begin(), out.end(), std::uint8_t(0));
        std::vector<std::uint8_t> open(std::size_t(size[2]), 0);
        tbb::parallel_for(0, size[2], [&](int k) {
            open[k] =
                !fill_slice(first + k, size, out.data() + std::size_t(k) * std::size_t(size[0]) * std::size_t(size[1]));
        });
        if (std::find(open.begin(), open.end(), 1) != open.end()) throw Error(Errc::InvalidInput, not_closed);
    }

private:
    struct Crossing {
        int row;
        double x;
        int direction;
        friend bool operator<(const Crossing& a, const Crossing& b) {
            return a.row != b.row ? a.row < b.row : a.x < b.x;
        }
    };
    struct Range {
        double low, high;
    };

    [[nodiscard]] Range extent(std::uint32_t t, int axis) const {
        const auto& [a, b, c] = mesh_.triangles[t];
        const auto [low, high] = std::minmax({points_[a][axis], points_[b][axis], points_[c][axis]});
        return {low, high};
    }

    template <typename Visit>
    void for_each_slice(int slices, const Visit& visit) const {
        for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
            const Range range = extent(t, 2);
            const int last = int(std::min(double(slices - 1), std::floor(range.high)));
            for (int k = int(std::max(0.0, std::ceil(range.low))); k <= last; ++k) visit(t, k);
        }
    }

    /// Twice the signed area of the triangle of a, b and the row, projected onto the plane of j and k, and its sign
    /// after the infinitesimal shift of the row. Exchanging a and b exactly negates both.
    struct Turn {
        double area;
        int sign;
    };
    static Turn turn(const Vec3& a, const Vec3& b, double j, double k) {
        const bool swapped = b[1] < a[1] || (b[1] == a[1] && b[2] < a[2]);
        const Vec3& p = swapped ? b : a;
        const Vec3& q = swapped ? a : b;
        const double dj = q[1] - p[1], dk = q[2] - p[2];
        const double area = dj * (k - p[2]) - dk * (j - p[1]);
        const double decisive = area != 0 ? area : dk != 0 ? -dk : dj;
        const int sign = (decisive > 0) - (decisive < 0);
        return swapped ? Turn{-area, -sign} : Turn{area, sign};
    }

    /// Fills one slice. @return false if a row does not leave the solid as often as it enters it
    bool fill_slice(int k, const Index3& size, std::uint8_t* out) const {
        std::vector<Crossing> crossings;
        for (std::size_t n = triangles_of_[k]; n < triangles_of_[k + 1]; ++n) {
            const std::uint32_t t = order_[n];
            const auto& [a, b, c] = mesh_.triangles[t];
            const Range rows = extent(t, 1);
            const Range along = extent(t, 0);
            const int last = int(std::min(double(size[1] - 1), std::floor(rows.high)));
            for (int j = int(std::max(0.0, std::ceil(rows.low))); j <= last; ++j) {
                const Turn ab = turn(points_[a], points_[b], j, k);
                const Turn bc = turn(points_[b], points_[c], j, k);
                const Turn ca = turn(points_[c], points_[a], j, k);
                if (ab.sign == 0 || ab.sign != bc.sign || ab.sign != ca.sign) continue;
                const double sum = ab.area + bc.area + ca.area;
                const double x = (bc.area * points_[a][0] + ca.area * points_[b][0] + ab.area * points_[c][0]) / sum;
                crossings.push_back({j, sum != 0 ? std::clamp(x, along.low, along.high) : along.low, ab.sign});
            }
        }
        std::sort(crossings.begin(), crossings.end());
        int winding = 0;
        for (std::size_t n = 0; n < crossings.size(); ++n) {
            winding += crossings[n].direction;
            const bool row_ends = n + 1 == crossings.size() || crossings[n + 1].row != crossings[n].row;
            if (row_ends && winding != 0) return false;
            if (row_ends || winding == 0) continue;
            const int begin = int(std::max(0.0, std::ceil(crossings[n].x)));
            const int end = int(std::min(double(size[0]), std::ceil(crossings[n + 1].x)));
            for (int i = begin; i < end; ++i)
                out[std::size_t(crossings[n].row) * std::size_t(size[0]) + std::size_t(i)] = 1;
        }
        return true;
    }

    const TriangleMesh& mesh_;
    std::vector<Vec3> points_;
    std::vector<std::size_t> triangles_of_;
    std::vector<std::uint32_t> order_;
};

}  // namespace covol::meshing
