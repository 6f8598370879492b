#include "render/volume.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "base/geometry.h"

namespace covol::figure {
namespace {

constexpr double kMaxVoxels = 3.2e7;
constexpr double kMaxRays = 1.2e6;
constexpr int kMaxSteps = 1200;
constexpr double kDark = 0.12;  // values, 0 to 1, up to which voxels are transparent

Index3 choose_step(const VoxelBox& region, const Vec3& spacing) {
    Index3 step{1, 1, 1};
    const auto count = [&] {
        double n = 1;
        for (int a = 0; a < 3; ++a) n *= std::ceil(double(region.size()[a]) / step[a]);
        return n;
    };
    while (count() > kMaxVoxels) {
        int finest = 0;
        for (int a = 1; a < 3; ++a)
            if (spacing[a] * step[a] < spacing[finest] * step[finest]) finest = a;
        ++step[finest];
    }
    return step;
}

}  // namespace

Volume::Volume(const Image& image, const VoxelBox& region, const std::array<double, 2>& window, const RunContext& run)
    : geometry_(cropped(image.geometry(), region)) {
    const Index3 step = choose_step(region, geometry_.spacing), whole = region.size();
    Vec3 first{0, 0, 0};
    for (int a = 0; a < 3; ++a) {
        geometry_.size[a] = std::max(1, whole[a] / step[a]);
        first[a] = 0.5 * (std::min(step[a], whole[a]) - 1);
    }
    geometry_.origin = geometry_.index_to_world(first);
    for (int a = 0; a < 3; ++a) geometry_.spacing[a] *= step[a];
    image.load(region, run);
    const Index3 n = geometry_.size;
    voxels_.resize(std::size_t(n[0]) * n[1] * n[2]);
    const double scale = 255 / std::max(1e-300, window[1] - window[0]);
    tbb::parallel_for(0, n[2], [&](int k) {
        if (run.cancelled()) return;
        std::vector<float> means, row;
        means.resize(std::size_t(n[0]) * n[1]);
        VoxelBox box = region;
        const int layers = std::min(step[2], whole[2]), lines = std::min(step[1], whole[1]);
        for (int layer = 0; layer < layers; ++layer)
            for (int j = 0; j < n[1] * lines; ++j) {
                box.min[2] = box.max[2] = region.min[2] + k * step[2] + layer;
                box.min[1] = box.max[1] = region.min[1] + j;
                box.max[0] = region.min[0] + n[0] * std::min(step[0], whole[0]) - 1;
                row.resize(std::size_t(box.size()[0]));
                image.copy(box, row.data());
                float* const to = means.data() + std::size_t(j / lines) * n[0];
                for (std::size_t i = 0; i < row.size(); ++i) to[i / std::min(step[0], whole[0])] += row[i];
            }
        const double fraction = 1.0 / (double(layers) * lines * std::min(step[0], whole[0]));
        std::transform(means.begin(), means.end(), voxels_.begin() + std::ptrdiff_t(means.size()) * k, [&](float v) {
            return std::uint8_t(std::lround(std::clamp((double(v) * fraction - window[0]) * scale, 0.0, 255.0)));
        });
    });
    run.check();
}

double Volume::at(const Vec3& index) const {
    int base[3];
    double part[3];
    for (int a = 0; a < 3; ++a) {
        const double x = index[a];
        if (!(x > -0.5) || !(x < geometry_.size[a] - 0.5)) return 0;
        const double inside = std::clamp(x, 0.0, geometry_.size[a] - 1.0);
        base[a] = std::min(int(inside), std::max(0, geometry_.size[a] - 2));
        part[a] = inside - base[a];
    }
    const std::ptrdiff_t dj = geometry_.size[0], dk = dj * geometry_.size[1];
    const std::ptrdiff_t di = geometry_.size[0] > 1 ? 1 : 0;
    const std::uint8_t* const v = voxels_.data() + base[0] + base[1] * dj + base[2] * dk;
    const std::ptrdiff_t j = geometry_.size[1] > 1 ? dj : 0, k = geometry_.size[2] > 1 ? dk : 0;
    const auto line = [&](std::ptrdiff_t at) { return v[at] + part[0] * (double(v[at + di]) - v[at]); };
    const double near = line(0) + part[1] * (line(j) - line(0)), far = line(k) + part[1] * (line(j + k) - line(k));
    return (near + part[2] * (far - near)) / 255;
}

Layer cast_volume(const Volume& volume, const Camera& camera, double density, bool on_white, const RunContext& run) {
    const ImageGeometry& g = volume.geometry();
    const double finest = g.smallest_spacing();
    const Rect& at = camera.at;
    // Rays need not be finer than voxels; colours are interpolated between them.
    const double coarse =
        std::max({1.0, 0.6 * finest / camera.pixel, std::sqrt(double(at.width) * at.height / kMaxRays)});
    const int width = std::max(2, int(std::ceil(at.width / coarse)) + 1);
    const int height = std::max(2, int(std::ceil(at.height / coarse)) + 1);
    double thinnest = 1e300, longest = 0;
    for (int a = 0; a < 3; ++a) {
        thinnest = std::min(thinnest, g.size[a] * g.spacing[a]);
        longest += std::pow(g.size[a] * g.spacing[a], 2);
    }
    const double step = std::max(0.7 * finest, std::sqrt(longest) / kMaxSteps);
    const double absorption = 6 * density * step / thinnest;
    const Vec3 zero = g.world_to_index({0, 0, 0});
    // Change of the index per world unit along the ray.
    const Vec3 slope = times(-1, minus(g.world_to_index(camera.basis.to_eye), zero));
    std::vector<Color> colors(std::size_t(width) * height);
    std::vector<float> fractions(colors.size());
    tbb::parallel_for(0, height, [&](int y) {
        for (int x = 0; x < width && !run.cancelled(); ++x) {
            const Vec3 start = g.world_to_index(camera.place(at.x + x * coarse, at.y + y * coarse));
            double from = 0, to = 1e300;
            for (int a = 0; a < 3; ++a) {
                const double low = -0.5 - start[a], high = g.size[a] - 0.5 - start[a];
                if (std::abs(slope[a]) < 1e-12 && (low > 0 || high < 0)) to = -1;
                if (std::abs(slope[a]) < 1e-12) continue;
                from = std::max(from, std::min(low / slope[a], high / slope[a]));
                to = std::min(to, std::max(low / slope[a], high / slope[a]));
            }
            double fraction = 0, light = 0;
            for (double t = from + 0.5 * step; t < to && fraction < 0.995; t += step) {
                const double value = std::max(0.0, (volume.at(plus(start, times(t, slope))) - kDark) / (1 - kDark));
                const double adds = (1 - fraction) * (1 - std::exp(-absorption * value * std::sqrt(value)));
                light += adds * (on_white ? 0.80 - 0.65 * value : 0.15 + 0.85 * value);
                fraction += adds;
            }
            colors[std::size_t(y) * width + x] = gray(light);
            fractions[std::size_t(y) * width + x] = float(fraction);
        }
    });
    run.check();
    Layer layer{at.width, at.height, {}, {}, {}, {}};
    layer.color.resize(std::size_t(at.width) * at.height);
    layer.fraction.resize(layer.color.size());
    tbb::parallel_for(0, at.height, [&](int y) {
        const double v = std::min((y + 0.5) / coarse, height - 1.001);
        for (int x = 0; x < at.width; ++x) {
            const double u = std::min((x + 0.5) / coarse, width - 1.001);
            const std::size_t corner = std::size_t(v) * width + std::size_t(u), below = corner + std::size_t(width);
            const double s = u - std::floor(u), t = v - std::floor(v);
            const std::size_t n = std::size_t(y) * at.width + x;
            layer.color[n] =
                mix(mix(colors[corner], colors[corner + 1], s), mix(colors[below], colors[below + 1], s), t);
            layer.fraction[n] = float((1 - t) * ((1 - s) * fractions[corner] + s * fractions[corner + 1]) +
                                      t * ((1 - s) * fractions[below] + s * fractions[below + 1]));
        }
    });
    return layer;
}

}  // namespace covol::figure
