// Quadrics through neighbourhoods: how far apart the points of a cloud lie on its surface, and how far off it.
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/median.h"
#include "cloud/orientation/heuristics.h"
#include "covol/orientation.h"
#include "covol/points.h"
#include "points/point_cells.h"

namespace covol {
namespace {

constexpr double kCellRadii = 2;  // edge of the cells that points are sorted into, in first radii

/// Standard deviation of points from the quadric over the plane of the last two axes that fits them best.
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

struct Around {
    double count = 0;  ///< of points; 0: too few
    double noise = 0;  ///< their standard deviation from a quadric
};

Around look_around(const cloud::PointCells& cells, const Vec3& at, double radius) {
    std::vector<cloud::PointCells::Range> ranges;
    cells.find(at, radius, ranges);
    std::vector<Eigen::Vector3d> near;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (const auto& range : ranges)
        for (std::uint32_t p = range.begin; p < range.end; ++p) {
            const Vec3& q = cells.sorted()[p];
            const Eigen::Vector3d v(q[0] - at[0], q[1] - at[1], q[2] - at[2]);
            if (v.squaredNorm() > radius * radius) continue;
            near.emplace_back(v / radius);
            sum += near.back();
            squares += near.back() * near.back().transpose();
        }
    if (near.size() < kCloudScale.least) return {};
    const double count = double(near.size());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares / count -
                                                              sum * sum.transpose() / (count * count));
    return {count, radius * off_quadric(near, axes.eigenvectors())};
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
    scale.spacing = 2 * nearest;  // what it is for points spread evenly at random
    if (!(nearest > 0)) return scale;
    const std::size_t step = std::max<std::size_t>(1, points.size() / kCloudScale.samples);
    double radius = kCloudScale.first_spacings * nearest, best = 1;
    const cloud::PointCells cells(points, kCellRadii * radius);
    for (int n = 0; n < kCloudScale.radii; ++n, radius *= kCloudScale.growth) {
        run.check();
        std::vector<Around> around((points.size() + step - 1) / step);
        tbb::parallel_for(std::size_t(0), around.size(),
                          [&](std::size_t m) { around[m] = look_around(cells, points[m * step], radius); });
        std::erase_if(around, [](const Around& a) { return a.count == 0; });
        if (2 * around.size() * step < points.size()) continue;  // too few neighbours yet
        const double noise = median_of(around, [](const Around& a) { return a.noise; });
        if (noise / radius < best) {
            best = noise / radius;
            scale.spacing = median_of(around, [&](const Around& a) { return radius * std::sqrt(M_PI / a.count); });
            scale.noise = noise;
        }
        // Wider, the surface's own curvature is all that comes.
        if (best < kCloudScale.sheet || noise / radius > kCloudScale.worse * best) break;
    }
    return scale;
}

}  // namespace covol
