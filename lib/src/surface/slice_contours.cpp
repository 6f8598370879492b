// Intersections of surfaces with the slices of an image.
#include "covol/slice_contours.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "surface/keyholes.h"

namespace covol {
namespace {

using detail::PlanePoint;

/// The extent of a surface, in voxels of an image.
struct Reach {
    Vec3 low, high;
};

/// Samples of a level set in a slice of an image, at nodes that may be closer together than the image's voxels, with a
/// rim of one node around them.
class SliceNodes {
public:
    /// @param reach  of the surface, in voxels of the image
    /// @param parts  number of node intervals per voxel edge along i and j
    SliceNodes(const FloatGrid& surface, const ImageGeometry& geometry, int k, const Reach& reach,
               const std::array<int, 2>& parts)
        : parts_(parts), accessor_(surface.getConstAccessor()) {
        const openvdb::math::Transform& transform = surface.transform();
        const auto place = [&](double i, double j) {
            const Vec3 world = geometry.index_to_world({i, j, double(k)});
            return transform.worldToIndex(openvdb::Vec3d(world[0], world[1], world[2]));
        };
        first_ = place(0, 0);
        along_ = {(place(1, 0) - first_) / parts[0], (place(0, 1) - first_) / parts[1]};
        // Nodes within half a voxel before the first centre and after the last one, as far as the surface extends, and
        // the rim around them.
        for (std::size_t a = 0; a < 2; ++a) {
            const int half = (parts[a] - 1) / 2, last = (geometry.size[a] - 1) * parts[a] + half;
            low_[a] = std::max(-half, int(std::clamp(std::floor(reach.low[a] * parts[a]), -1e9, 1e9))) - 1;
            const int high = std::min(last, int(std::clamp(std::ceil(reach.high[a] * parts[a]), -1e9, 1e9))) + 1;
            count_[a] = std::max(high - low_[a] + 1, 1);
        }
        values_.resize(std::size_t(count_[0]) * std::size_t(count_[1]));
        for (int y = 0; y < count_[1]; ++y)
            for (int x = 0; x < count_[0]; ++x) values_[at(x, y)] = sample(x, y);
        close_rim();
    }

    [[nodiscard]] int width() const { return count_[0]; }
    [[nodiscard]] int height() const { return count_[1]; }
    [[nodiscard]] float value(int x, int y) const { return values_[at(x, y)]; }
    /// A position between nodes, in voxels of the image.
    [[nodiscard]] PlanePoint in_voxels(double x, double y) const {
        return {(x + low_[0]) / parts_[0], (y + low_[1]) / parts_[1]};
    }

private:
    [[nodiscard]] std::size_t at(int x, int y) const {
        return std::size_t(y) * std::size_t(count_[0]) + std::size_t(x);
    }
    [[nodiscard]] float sample(int x, int y) const {
        const openvdb::Vec3d p = first_ + along_[0] * double(x + low_[0]) + along_[1] * double(y + low_[1]);
        const openvdb::Coord base = openvdb::Coord::floor(p);
        const openvdb::Vec3d t = p - base.asVec3d();
        double sum = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const openvdb::Coord c(corner & 1, corner >> 1 & 1, corner >> 2);
            double weight = 1;
            for (int a = 0; a < 3; ++a) weight *= c[a] != 0 ? t[a] : 1 - t[a];
            if (weight != 0) sum += weight * accessor_.getValue(base + c);
        }
        return static_cast<float>(sum);
    }
    /// If the surface reaches the rim, closes it half a voxel beyond the last voxel centres. For even `parts`, this is
    /// on the rim itself, otherwise halfway between the rim and the adjacent nodes.
    void close_rim() {
        const auto close = [&](int x, int y) {
            float& value = values_[at(x, y)];
            if (value >= 0) return;
            const int i = std::clamp(x, 1, std::max(1, count_[0] - 2)),
                      j = std::clamp(y, 1, std::max(1, count_[1] - 2));
            const bool is_at_end = parts_[i == x ? 1 : 0] % 2 == 0;
            value = std::max(is_at_end ? 0 : std::abs(values_[at(i, j)]), std::numeric_limits<float>::min());
        };
        for (int x = 0; x < count_[0]; ++x) {
            close(x, 0);
            close(x, count_[1] - 1);
        }
        for (int y = 0; y < count_[1]; ++y) {
            close(0, y);
            close(count_[0] - 1, y);
        }
    }

    std::array<int, 2> parts_, low_{}, count_{};
    FloatGrid::ConstAccessor accessor_;
    openvdb::Vec3d first_;
    std::array<openvdb::Vec3d, 2> along_;
    std::vector<float> values_;
};

/// Marching squares. The edge from node n along x has the number 2 n, the edge along y 2 n + 1.
class Squares {
public:
    explicit Squares(const SliceNodes& nodes) : nodes_(nodes) {
        next_.assign(2 * std::size_t(nodes.width()) * std::size_t(nodes.height()), kNone);
        for (int y = 0; y + 1 < nodes.height(); ++y)
            for (int x = 0; x + 1 < nodes.width(); ++x) add_cell(x, y);
    }

    /// Closed curves with the inside on their left (x to the right, y up), in the order of their first edges.
    [[nodiscard]] std::vector<std::vector<PlanePoint>> curves() {
        std::vector<std::vector<PlanePoint>> found;
        for (std::size_t first = 0; first < next_.size(); ++first) {
            if (next_[first] == kNone) continue;
            std::vector<PlanePoint> curve;
            for (std::size_t edge = first; next_[edge] != kNone;) {
                const PlanePoint point = crossing(edge);
                if (curve.empty() || curve.back() != point) curve.push_back(point);
                edge = std::exchange(next_[edge], kNone);
            }
            while (curve.size() > 1 && curve.front() == curve.back()) curve.pop_back();
            if (curve.size() > 2) found.push_back(std::move(curve));
        }
        return found;
    }

private:
    static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

    [[nodiscard]] std::size_t node(int x, int y) const {
        return std::size_t(y) * std::size_t(nodes_.width()) + std::size_t(x);
    }
    [[nodiscard]] PlanePoint crossing(std::size_t edge) const {
        const auto x = int(edge / 2 % std::size_t(nodes_.width())), y = int(edge / 2 / std::size_t(nodes_.width()));
        const bool upward = edge % 2 != 0;
        const double from = nodes_.value(x, y), to = upward ? nodes_.value(x, y + 1) : nodes_.value(x + 1, y);
        const double t = from / (from - to);
        return upward ? nodes_.in_voxels(x, y + t) : nodes_.in_voxels(x + t, y);
    }
    void add_cell(int x, int y) {
        // Corners and edges are numbered anticlockwise; edge n leads from corner n to the next.
        const float corner[4] = {nodes_.value(x, y), nodes_.value(x + 1, y), nodes_.value(x + 1, y + 1),
                                 nodes_.value(x, y + 1)};
        const std::size_t edge[4] = {2 * node(x, y), 2 * node(x + 1, y) + 1, 2 * node(x, y + 1), 2 * node(x, y) + 1};
        // The mean of the corners decides whether two diagonally opposite inside corners are joined.
        const bool joined = (double(corner[0]) + corner[1] + corner[2] + corner[3]) < 0;
        for (int n = 0; n < 4; ++n) {
            // Around the cell, anticlockwise, a curve enters at an edge from inside to outside and leaves at one from
            // outside to inside.
            if (!(corner[n] < 0) || corner[(n + 1) % 4] < 0) continue;
            int out = n;
            if (joined) {
                do out = (out + 1) % 4;
                while (!(corner[out] >= 0 && corner[(out + 1) % 4] < 0));
            } else {
                do out = (out + 3) % 4;
                while (!(corner[out] >= 0 && corner[(out + 1) % 4] < 0));
            }
            next_[edge[n]] = edge[out];
        }
    }

    const SliceNodes& nodes_;
    std::vector<std::size_t> next_;  ///< for each edge, the next edge that its curve crosses
};

Reach reach_of(const FloatGrid& surface, const ImageGeometry& geometry) {
    const openvdb::CoordBBox box = surface.evalActiveVoxelBoundingBox();
    Reach reach;
    reach.low.fill(std::numeric_limits<double>::max());
    reach.high.fill(std::numeric_limits<double>::lowest());
    for (int corner = 0; corner < 8 && !box.empty(); ++corner) {
        openvdb::Vec3d at;
        for (int a = 0; a < 3; ++a) at[a] = (corner >> a & 1) != 0 ? box.max()[a] + 1 : box.min()[a] - 1;
        const openvdb::Vec3d world = surface.transform().indexToWorld(at);
        const Vec3 voxel = geometry.world_to_index({world[0], world[1], world[2]});
        for (std::size_t a = 0; a < 3; ++a) {
            reach.low[a] = std::min(reach.low[a], voxel[a]);
            reach.high[a] = std::max(reach.high[a], voxel[a]);
        }
    }
    return reach;
}

}  // namespace

std::vector<SliceContour> outline_slices(const FloatGrid& surface, const ImageGeometry& geometry,
                                         const RunContext& run) {
    std::vector<std::vector<SliceContour>> of_slice(std::size_t(geometry.size[2]));
    const Reach reach = reach_of(surface, geometry);
    const double h = surface.voxelSize()[0];
    std::array<int, 2> parts{};
    for (std::size_t a = 0; a < 2; ++a)
        parts[a] = std::max(1, int(std::ceil(geometry.spacing[a] / h * (1 - 1e-6))));  // 1 if equal up to rounding
    with_threads(run, [&] {
        tbb::parallel_for(0, geometry.size[2], [&](int k) {
            if (run.cancelled() || !(k >= reach.low[2] && k <= reach.high[2])) return;
            const SliceNodes nodes(surface, geometry, k, reach, parts);
            for (const std::vector<PlanePoint>& curve : detail::join_holes(Squares(nodes).curves())) {
                SliceContour& contour = of_slice[std::size_t(k)].emplace_back(SliceContour{k, {}});
                for (const auto& [i, j] : curve) contour.points.push_back(geometry.index_to_world({i, j, double(k)}));
            }
        });
    });
    run.check();
    std::vector<SliceContour> contours;
    for (std::vector<SliceContour>& some : of_slice)
        for (SliceContour& contour : some) contours.push_back(std::move(contour));
    return contours;
}

}  // namespace covol
