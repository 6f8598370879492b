#include "io/write/zarr_levels.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

template <typename T>
T most_frequent_of(const T* values, int count) {
    T best = values[0];
    int maximum = 0;
    for (int n = 0; n < count; ++n) {
        const auto times = static_cast<int>(std::count(values, values + count, values[n]));
        if (times > maximum) {
            maximum = times;
            best = values[n];
        }
        if (2 * maximum > count) break;
    }
    return best;
}

template <typename T>
T mean_of(const T* values, int count) {
    double sum = 0;
    for (int n = 0; n < count; ++n) sum += double(values[n]);
    const double mean = sum / count;
    if constexpr (std::is_floating_point_v<T>)
        return static_cast<T>(mean);
    else
        return static_cast<T>(std::nearbyint(mean));
}

}  // namespace

std::vector<PyramidLevel> pyramid_levels(const ImageGeometry& geometry, const Index3& chunk) {
    std::vector<PyramidLevel> levels{{geometry.size}};
    for (;;) {
        const PyramidLevel& fine = levels.back();
        double finest = std::numeric_limits<double>::infinity();
        const auto spacing = [&](int a) { return geometry.spacing[a] * fine.scale[a]; };
        for (int a = 0; a < 3; ++a)
            if (fine.size[a] > chunk[a]) finest = std::min(finest, spacing(a));
        if (std::isinf(finest)) return levels;
        PyramidLevel coarse = fine;
        for (int a = 0; a < 3; ++a) {
            coarse.factor[a] = fine.size[a] > 1 && spacing(a) < 2 * finest ? 2 : 1;
            coarse.scale[a] *= coarse.factor[a];
            coarse.size[a] = (fine.size[a] - 1) / coarse.factor[a] + 1;
        }
        levels.push_back(coarse);
    }
}

VoxelBox finest_box(const PyramidLevel& level, const VoxelBox& box, const Index3& finest) {
    VoxelBox fine;
    for (int a = 0; a < 3; ++a) {
        fine.min[a] = box.min[a] * level.scale[a];
        fine.max[a] =
            static_cast<int>(std::min((std::int64_t(box.max[a]) + 1) * level.scale[a], std::int64_t(finest[a])) - 1);
    }
    return fine;
}

void coarsen(PixelType type, bool most_frequent, const Index3& factor, const void* fine, const Index3& fine_size,
             void* coarse, const Index3& first, const Index3& coarse_size) {
    with_pixel_type(type, [&](auto pixel) {
        using T = decltype(pixel);
        const auto* from = static_cast<const T*>(fine);
        auto* to = static_cast<T*>(coarse);
        const auto at = [](const Index3& size, int i, int j, int k) {
            return (std::size_t(k) * std::size_t(size[1]) + std::size_t(j)) * std::size_t(size[0]) + std::size_t(i);
        };
        std::array<T, 8> values{};
        for (int k = 0; k < fine_size[2]; k += factor[2])
            for (int j = 0; j < fine_size[1]; j += factor[1]) {
                T* out = to + at(coarse_size, first[0], first[1] + j / factor[1], first[2] + k / factor[2]);
                for (int i = 0; i < fine_size[0]; i += factor[0]) {
                    int count = 0;
                    bool same = true;
                    for (int z = k; z < std::min(k + factor[2], fine_size[2]); ++z)
                        for (int y = j; y < std::min(j + factor[1], fine_size[1]); ++y)
                            for (int x = i; x < std::min(i + factor[0], fine_size[0]); ++x) {
                                values[std::size_t(count)] = from[at(fine_size, x, y, z)];
                                same = same && values[std::size_t(count)] == values[0];
                                ++count;
                            }
                    *out++ = same            ? values[0]
                             : most_frequent ? most_frequent_of(values.data(), count)
                                             : mean_of(values.data(), count);
                }
            }
    });
}

}  // namespace covol::detail
