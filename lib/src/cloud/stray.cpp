#include "cloud/stray.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "cloud/median.h"
#include "cloud/neighbours.h"

namespace covol::cloud {
namespace {

constexpr std::size_t kNeighbours = 8;
constexpr double kFar = 2.5;        // times the median distance to the eighth neighbour
constexpr double kOffPlane = 0.25;  // standard deviation of the neighbours, or the point's own distance, of that to the eighth

}  // namespace

std::vector<char> find_stray(const std::vector<Vec3>& points, double spacing, const RunContext& run) {
    std::vector<char> stray(points.size(), 0);
    if (points.size() <= 2 * kNeighbours) return stray;
    const PointCells cells(points, kFirstRadius * spacing);
    std::vector<double> reach(points.size()), off(points.size());
    run.check();
    for_nearest(cells, spacing, kNeighbours, [&](std::uint32_t point, const std::vector<Neighbour>& near) {
        reach[point] = near.size() < kNeighbours ? 1e300 : std::sqrt(near.back().squared);
        if (near.size() < kNeighbours) {
            off[point] = 1;
            return;
        }
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
        const Vec3& p = points[point];
        for (const Neighbour& n : near) {
            const Vec3& q = cells.sorted()[n.at];
            const Eigen::Vector3d v(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
            sum += v;
            squares += v * v.transpose();
        }
        const double count = double(near.size());
        sum /= count;
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares / count - sum * sum.transpose());
        const double deviation = std::sqrt(std::max(0.0, axes.eigenvalues()[0]));
        off[point] = std::max(deviation, std::abs(axes.eigenvectors().col(0).dot(sum))) / reach[point];
    });
    const double usual = median(reach);
    for (std::size_t n = 0; n < points.size(); ++n) {
        // The farther the neighbours, the flatter they have to lie.
        const double far = reach[n] / (kFar * usual);
        stray[n] = far > 1 && off[n] * far > kOffPlane;
    }
    return stray;
}

}  // namespace covol::cloud
