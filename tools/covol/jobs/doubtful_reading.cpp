#include "jobs/doubtful_reading.h"

#include <algorithm>
#include <cmath>

namespace covol::tool {
namespace {

/// Magnitude of the gradient by central differences; nullopt at the border of the loaded part of the image or beyond.
std::optional<double> edge_at(const Image& image, const Vec3& index) {
    Index3 voxel{};
    for (int a = 0; a < 3; ++a) {
        voxel[a] = int(std::lround(index[a]));
        if (voxel[a] <= image.held().min[a] || voxel[a] >= image.held().max[a]) return std::nullopt;
    }
    double square = 0;
    for (int a = 0; a < 3; ++a) {
        Index3 before = voxel, behind = voxel;
        --before[a];
        ++behind[a];
        const double step = (image.at(behind[0], behind[1], behind[2]) - image.at(before[0], before[1], before[2])) /
                            (2 * image.geometry().spacing[a]);
        square += step * step;
    }
    return std::sqrt(square);
}

}  // namespace

std::optional<double> edges_if_voxels(const std::vector<Vec3>& marks, const Image& image) {
    constexpr std::size_t kFewest = 8, kMax = 100;
    constexpr double kClearly = 2, kClearFraction = 0.7;
    const ImageGeometry& geometry = image.geometry();
    if (marks.size() < kFewest || !geometry.spacing_known) return std::nullopt;
    double apart = 0;
    for (const Vec3& p : marks) {
        const Vec3 now = geometry.world_to_index(p);
        for (int a = 0; a < 3; ++a) {
            if (p[a] < -0.5 || p[a] > geometry.size[a] - 0.5) return std::nullopt;
            apart = std::max(apart, std::abs(p[a] - now[a]));
        }
    }
    if (apart < 1) return std::nullopt;
    double now = 0, otherwise = 0;
    std::size_t seen = 0, stronger = 0;
    const std::size_t step = (marks.size() + kMax - 1) / kMax;
    for (std::size_t n = 0; n < marks.size(); n += step) {
        const auto here = edge_at(image, geometry.world_to_index(marks[n])), there = edge_at(image, marks[n]);
        if (!here || !there) continue;
        now += *here;
        otherwise += *there;
        ++seen;
        stronger += *there > *here ? 1 : 0;
    }
    if (seen < kFewest || double(stronger) < kClearFraction * double(seen) || !(otherwise > kClearly * now))
        return std::nullopt;
    return now > 0 ? otherwise / now : otherwise;
}

}  // namespace covol::tool
