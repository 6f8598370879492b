// Measures the spacing of a cloud's points on its surface, and their distances from it, by quadrics fitted to
// neighbourhoods.
#include <tbb/concurrent_vector.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/heuristics.h"
#include "base/median.h"
#include "cloud/orientation/heuristics.h"
#include "covol/orientation.h"
#include "covol/points.h"
#include "points/neighbours.h"

namespace covol {
namespace {

constexpr double kCellRadii = 2;      // edge length of the cells that sort the points, relative to the smallest radius
constexpr std::size_t kNearest = 12;  // points in a group of nearest ones: twice a quadric's coefficients

/// Standard deviation of points from the best-fitting quadric over the plane of the second and third axes.
double off_quadric(const std::vector<Eigen::Vector3d>& points, const Eigen::Matrix3d& axes) {
    using Vector6 = Eigen::Matrix<double, 6, 1>;
    Eigen::Matrix<double, 6, 6> m = Eigen::Matrix<double, 6, 6>::Zero();
    Vector6 right = Vector6::Zero();
    double squares = 0;
    for (const Eigen::Vector3d& p : points) {
        const Eigen::Vector3d x = axes.transpose() * p;
        Vector6 b;
        b << 1, x[1], x[2], x[1] * x[1], x[1] * x[2], x[2] * x[2];
        m.noalias() += b * b.transpose();
        right += x[0] * b;
        squares += x[0] * x[0];
    }
    const double left = squares - right.dot(m.ldlt().solve(right));
    return std::sqrt(std::max(0.0, left) / double(points.size() - 6));
}

/// Standard deviation of points from the best-fitting quadric over their best-fitting plane.
double off_sheet(const std::vector<Eigen::Vector3d>& points) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& p : points) {
        sum += p;
        squares += p * p.transpose();
    }
    const double count = double(points.size());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares / count -
                                                              sum * sum.transpose() / (count * count));
    return off_quadric(points, axes.eigenvectors());
}

Eigen::Vector3d from_to(const Vec3& from, const Vec3& to) {
    return {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
}

struct Around {
    double reach = 0;  ///< radius that contains the points
    double count = 0;  ///< number of points; 0: too few
    double noise = 0;  ///< their standard deviation from a quadric
};

Around measure_around(const cloud::PointCells& cells, const Vec3& at, double radius) {
    std::vector<cloud::PointCells::Range> ranges;
    cells.find(at, radius, ranges);
    std::vector<Eigen::Vector3d> near;
    for (const auto& range : ranges)
        for (std::uint32_t p = range.begin; p < range.end; ++p) {
            const Eigen::Vector3d v = from_to(at, cells.sorted()[p]);
            if (v.squaredNorm() <= radius * radius) near.emplace_back(v / radius);
        }
    if (near.size() < kCommon.quadric) return {};
    return {radius, double(near.size()), radius * off_sheet(near)};
}

/// Measures the group of kNearest points, of which one is the point itself, for every `step`-th point.
std::vector<Around> measure_nearest(const std::vector<Vec3>& points, const cloud::PointCells& cells, double nearest,
                                    std::size_t step) {
    tbb::concurrent_vector<Around> around;  // its order varies with the threads, but does not affect the medians
    cloud::for_nearest(
        cells, 2 * nearest, kNearest - 1,
        [&](std::uint32_t point, const std::vector<cloud::Neighbour>& near) {
            if (near.size() + 1 < kNearest) return;
            const double reach = std::sqrt(near.back().squared);
            std::vector<Eigen::Vector3d> places{Eigen::Vector3d::Zero()};
            for (const cloud::Neighbour& other : near)
                places.push_back(from_to(points[point], cells.sorted()[other.at]) / reach);
            around.push_back({reach, kNearest, reach * off_sheet(places)});
        },
        [&](std::size_t n) { return n % step == 0; });
    return {around.begin(), around.end()};
}

template <typename Value>
double median_of(const std::vector<Around>& around, Value value) {
    std::vector<double> values(around.size());
    std::transform(around.begin(), around.end(), values.begin(), value);
    return cloud::median(std::move(values));
}

}  // namespace

CloudScale measure_cloud_scale(const std::vector<Vec3>& points, const RunContext& run) {
    CloudScale scale;
    const double nearest = scale.nearest = measure_spacing(points).median;
    scale.spacing = 2 * nearest;  // approximately true for points at random positions on a surface
    if (!(nearest > 0)) return scale;
    const std::size_t step = std::max<std::size_t>(1, points.size() / kCommon.sample);
    double radius = kCloudScale.first_spacings * nearest, best = 1;
    const cloud::PointCells cells(points, kCellRadii * radius);
    const std::vector<Around> closest = measure_nearest(points, cells, nearest, step);
    scale.near_reach = median_of(closest, [](const Around& a) { return a.reach; });
    scale.near_noise = median_of(closest, [](const Around& a) { return a.noise; });
    for (int n = 0; n < kCloudScale.radii; ++n, radius *= kCommon.growth) {
        run.check();
        std::vector<Around> around((points.size() + step - 1) / step);
        tbb::parallel_for(std::size_t(0), around.size(),
                          [&](std::size_t m) { around[m] = measure_around(cells, points[m * step], radius); });
        std::erase_if(around, [](const Around& a) { return a.count == 0; });
        if (2 * around.size() * step < points.size()) continue;  // most points have too few neighbours
        const double noise = median_of(around, [](const Around& a) { return a.noise; });
        if (noise / radius < best) {
            best = noise / radius;
            scale.spacing = median_of(around, [&](const Around& a) { return radius * std::sqrt(M_PI / a.count); });
            scale.noise = noise;
        }
        // Stops when the neighbourhoods are sheets, or when the deviation relative to the radius increases again,
        // because the surface's curvature then contributes to the deviation.
        if (best < kCloudScale.sheet || noise / radius > (1 + kCommon.minority) * best) break;
    }
    return scale;
}

}  // namespace covol
