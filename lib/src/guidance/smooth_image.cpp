#include "guidance/smooth_image.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "base/geometry.h"
#include "base/matrix.h"
#include "guidance/profile_kernel.h"
#include "limits/memory_budget.h"

namespace covol::guidance {
namespace {

constexpr double kKernelSigmas = 3.0;
constexpr double kMinSigma = 0.3;  // voxels; below it, the Gaussian's weights beside the centre are below 0.5 %

}  // namespace

SmoothImage::SmoothImage(const Image& image, const WorldBox& box, double sigma, const RunContext& run) {
    const ImageGeometry& g = image.geometry();
    Vec3 lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
    for (const Vec3& corner : corners(box)) {
        const Vec3 at = g.world_to_index(corner);
        for (int a = 0; a < 3; ++a) {
            lo[a] = std::min(lo[a], at[a]);
            hi[a] = std::max(hi[a], at[a]);
        }
    }
    Index3 first;
    for (int a = 0; a < 3; ++a) {
        const double halo = kKernelSigmas * sigma / g.spacing[a] + 1;
        first[a] = int(std::floor(std::clamp(lo[a] - halo, double(image.held().min[a]), double(image.held().max[a]))));
        const int last =
            int(std::ceil(std::clamp(hi[a] + halo, double(image.held().min[a]), double(image.held().max[a]))));
        if (hi[a] < image.held().min[a] || lo[a] > image.held().max[a]) return;
        size_[a] = last - first[a] + 1;
    }
    const Vec3 at_zero = g.world_to_index({0, 0, 0});
    const Matrix3 to_axes = detail::inverse(g.direction);
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) to_index_[a][b] = to_axes[a][b] / g.spacing[a];
        offset_[a] = at_zero[a] - first[a];
        low_[a] = -0.5 - first[a];
        high_[a] = g.size[a] - 0.5 - first[a];
    }
    detail::require_memory(sizeof(float) * double(size_[0]) * size_[1] * size_[2],
                           "image guidance: a smoothed copy of " + image.path() + " around the marks",
                           "use a coarser image, a smaller `roi`, or `rho = 0`", run);
    values_.resize(std::size_t(size_[0]) * size_[1] * size_[2]);
    image.load({first, {first[0] + size_[0] - 1, first[1] + size_[1] - 1, first[2] + size_[2] - 1}}, run);
    tbb::parallel_for(0, size_[2], [&](int k) {
        const Index3 low{first[0], first[1], first[2] + k};
        image.copy({low, {first[0] + size_[0] - 1, first[1] + size_[1] - 1, first[2] + k}},
                   values_.data() + std::size_t(k) * size_[1] * size_[0]);
    });
    image.release();
    for (int a = 0; a < 3; ++a) smooth(a, sigma / g.spacing[a]);
}

void SmoothImage::smooth(int axis, double sigma) {
    const int count = size_[axis];
    if (sigma < kMinSigma || count < 2) return;
    const int radius = int(std::ceil(kKernelSigmas * sigma));
    std::vector<float> kernel(2 * std::size_t(radius) + 1);
    double sum = 0;
    for (int n = -radius; n <= radius; ++n) sum += kernel[n + radius] = float(std::exp(-0.5 * n * n / (sigma * sigma)));
    for (float& w : kernel) w = float(w / sum);
    const std::size_t stride = axis == 0 ? 1 : axis == 1 ? std::size_t(size_[0]) : std::size_t(size_[0]) * size_[1];
    const int a1 = axis == 0 ? 1 : 0, a2 = axis == 2 ? 1 : 2;
    const std::size_t stride1 = a1 == 0 ? 1 : std::size_t(size_[0]);
    const std::size_t stride2 = a2 == 1 ? std::size_t(size_[0]) : std::size_t(size_[0]) * size_[1];
    tbb::parallel_for(0, size_[a2], [&](int n2) {
        std::vector<float> line(std::size_t(count) + 2 * radius), out(line.size());
        for (int n1 = 0; n1 < size_[a1]; ++n1) {
            float* base = values_.data() + n1 * stride1 + n2 * stride2;
            const auto at = [&](int n) { return base[std::size_t(std::clamp(n, 0, count - 1)) * stride]; };
            // Beyond its end the image is continued by reflection about the last value: if that value were repeated,
            // a body that tapers towards the end would appear as wide at the end as a little before it.
            for (int n = -radius; n < count + radius; ++n)
                line[n + radius] = n < 0        ? 2 * at(0) - at(-n)
                                   : n >= count ? 2 * at(count - 1) - at(2 * (count - 1) - n)
                                                : at(n);
            convolve(line.data(), kernel.data(), kernel.size(), out.data(), std::size_t(count));
            for (int n = 0; n < count; ++n) base[n * stride] = out[n];
        }
    });
}

SmoothImage::Line SmoothImage::along(const Vec3& first, const Vec3& step) const {
    Line line;
    line.image_ = this;
    for (int a = 0; a < 3; ++a) {
        const Vec3& row = to_index_[a];
        line.first_[a] = row[0] * first[0] + row[1] * first[1] + row[2] * first[2] + offset_[a];
        line.step_[a] = row[0] * step[0] + row[1] * step[1] + row[2] * step[2];
    }
    return line;
}

bool SmoothImage::at(const Vec3& at, float& value) const {
    int base[3];
    float w[3];
    for (int a = 0; a < 3; ++a) {
        if (!(at[a] >= low_[a] && at[a] <= high_[a])) return false;
        const double inner = std::clamp(at[a], 0.0, double(size_[a] - 1));
        base[a] = std::min(int(inner), std::max(size_[a] - 2, 0));
        w[a] = float(inner - base[a]);
    }
    const std::size_t sy = std::size_t(size_[0]), sz = sy * size_[1];
    const std::size_t dx = size_[0] > 1 ? 1 : 0, dy = size_[1] > 1 ? sy : 0, dz = size_[2] > 1 ? sz : 0;
    const float* p = values_.data() + base[0] + base[1] * sy + base[2] * sz;
    const auto x = [&](const float* q) { return q[0] + w[0] * (q[dx] - q[0]); };
    const auto xy = [&](const float* q) { return x(q) + w[1] * (x(q + dy) - x(q)); };
    value = xy(p) + w[2] * (xy(p + dz) - xy(p));
    return true;
}

}  // namespace covol::guidance
