// Fits planes to neighbourhoods of a scan by principal component analysis (Hoppe et al. 1992), measures the distances
// of points from them and projects points onto them.
#include "covol/scan_noise.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/heuristics.h"
#include "covol/error.h"
#include "points/heuristics.h"

namespace covol {
namespace {

Eigen::Vector3d vector(const Vec3& p) { return {p[0], p[1], p[2]}; }

/// The points, sorted by cells of edge `radius`: all points within that distance of a position are in the 27 cells
/// around it.
class Neighbourhoods {
public:
    Neighbourhoods(const std::vector<Vec3>& points, double radius) : points_(points), radius_(radius) {
        lowest_ = bounding_box(points).min;
        cells_.resize(points.size());
        tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) { cells_[n] = {key(cell(points[n])), n}; });
        std::sort(cells_.begin(), cells_.end());
    }

    /// Calls visit(point, squared distance) for all points within the radius of x, including x if it is one of them.
    template <typename Visit>
    void around(const Vec3& x, Visit visit) const {
        const Index3 c = cell(x);
        for (int i = -1; i <= 1; ++i)
            for (int j = -1; j <= 1; ++j) {
                // Three successive cells along k are contiguous in the order.
                const std::uint64_t first = key({c[0] + i, c[1] + j, c[2] - 1}), last = first + 2;
                auto at = std::lower_bound(cells_.begin(), cells_.end(), std::pair{first, std::size_t(0)});
                for (; at != cells_.end() && at->first <= last; ++at) {
                    const Vec3& p = points_[at->second];
                    const double dx = p[0] - x[0], dy = p[1] - x[1], dz = p[2] - x[2], d2 = dx * dx + dy * dy + dz * dz;
                    if (d2 <= radius_ * radius_) visit(p, d2);
                }
            }
    }

private:
    [[nodiscard]] Index3 cell(const Vec3& p) const {
        Index3 c;
        for (int a = 0; a < 3; ++a)  // points beyond the last cell are put into it: slow, but correct
            c[a] = static_cast<int>(std::min((p[a] - lowest_[a]) / radius_, double(1 << 20)));
        return c;
    }
    // 1 is added to each index, because around() also forms the keys of cells with the index -1.
    [[nodiscard]] static std::uint64_t key(const Index3& c) {
        return (std::uint64_t(c[0] + 1) << 42) + (std::uint64_t(c[1] + 1) << 21) + std::uint64_t(c[2] + 1);
    }

    const std::vector<Vec3>& points_;
    double radius_;
    Vec3 lowest_;
    std::vector<std::pair<std::uint64_t, std::size_t>> cells_;
};

struct Plane {
    Eigen::Vector3d center{0, 0, 0}, normal{0, 0, 0};
    std::size_t points = 0;
    [[nodiscard]] double height(const Vec3& p) const { return normal.dot(vector(p) - center); }
};

/// @param weight  function of a neighbour's squared distance that returns its weight
template <typename Weight>
Plane fit_plane(const Neighbourhoods& cloud, const Vec3& x, Weight weight) {
    Plane plane;
    const Eigen::Vector3d origin = vector(x);
    Eigen::Vector3d sum(0, 0, 0);
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    double total = 0;
    cloud.around(x, [&](const Vec3& p, double d2) {
        const double w = weight(d2);
        const Eigen::Vector3d v = vector(p) - origin;
        total += w;
        sum += w * v;
        squares += w * v * v.transpose();
        ++plane.points;
    });
    if (plane.points < kCommon.quadric || !(total > 0)) return {};
    sum /= total;
    const Eigen::Matrix3d covariance = squares / total - sum * sum.transpose();
    plane.center = origin + sum;
    plane.normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(0);
    return plane;
}

double second_longest_edge(const WorldBox& box) {
    Vec3 edges;
    for (int a = 0; a < 3; ++a) edges[a] = box.max[a] - box.min[a];
    std::sort(edges.begin(), edges.end());
    return edges[1];
}

void expect_radius(double radius, const char* where) {
    if (!(radius > 0) || !std::isfinite(radius))
        throw Error(Errc::InvalidOptions, std::string(where) + ": radius: expected > 0, got " + std::to_string(radius));
}

}  // namespace

double measure_layer_thickness(const std::vector<Vec3>& points, double radius, const RunContext& run) {
    expect_radius(radius, "measure_layer_thickness");
    if (points.empty()) return 0;
    const Neighbourhoods cloud(points, radius);
    const std::size_t step = (points.size() + kCommon.sample - 1) / kCommon.sample;
    std::vector<double> distance((points.size() + step - 1) / step, -1.0);
    run.check();
    tbb::parallel_for(std::size_t(0), distance.size(), [&](std::size_t n) {
        const Vec3& x = points[n * step];
        const Plane plane = fit_plane(cloud, x, [](double) { return 1.0; });
        if (plane.points == 0) return;
        double sum = 0;
        cloud.around(x, [&](const Vec3& p, double) { sum += std::abs(plane.height(p)); });
        distance[n] = sum / double(plane.points);
    });
    double sum = 0;
    std::size_t count = 0;
    for (const double d : distance)
        if (d >= 0) sum += d, ++count;
    return count > 0 ? sum / double(count) : 0.0;
}

ScanVoxelSize choose_scan_voxel_size(const std::vector<Vec3>& points, double spacing, const RunContext& run) {
    ScanVoxelSize choice{spacing, 0};
    if (!(spacing > 0) || points.empty()) return choice;
    const double widest = second_longest_edge(bounding_box(points)) / 2;
    bool any = false, thin = false;
    // The search starts from the largest size, because in a ball with a radius of a few spacings a plane fits the few
    // points even if these fill space.
    for (int k = kCommon.rounds; k >= 0; --k) {
        const double h = spacing * std::pow(kCommon.growth, k);
        if (k > 0 && kScan.plane_voxels * h > widest) continue;
        const ScanVoxelSize finer{h, measure_layer_thickness(points, kScan.plane_voxels * h, run)};
        const bool holds = finer.thickness <= kScan.thin_fraction * h;
        if (thin && !holds) break;
        if (holds || !any) choice = finer;
        any = true;
        thin |= holds;
    }
    return choice;
}

std::vector<Vec3> average_layers(const std::vector<Vec3>& points, double radius, const RunContext& run) {
    expect_radius(radius, "average_layers");
    std::vector<Vec3> moved = points;
    for (int pass = 0; pass < kScan.passes && !points.empty(); ++pass) {
        run.check();
        const std::vector<Vec3> before = moved;
        const Neighbourhoods cloud(before, radius);
        tbb::parallel_for(std::size_t(0), before.size(), [&](std::size_t n) {
            const Plane plane = fit_plane(cloud, before[n], [&](double d2) {
                const double t = 1.0 - d2 / (radius * radius);
                return t * t;
            });
            if (plane.points == 0) return;
            const double height = plane.height(before[n]);
            for (int a = 0; a < 3; ++a) moved[n][a] -= height * plane.normal[a];
        });
    }
    return moved;
}

}  // namespace covol
