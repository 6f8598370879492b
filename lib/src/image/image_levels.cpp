#include "covol/image_levels.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "covol/error.h"
#include "io/pixels/chunk_cache.h"

namespace covol {
namespace {

/// Number of voxels of the finest level along an axis per voxel of a coarser level; 0 if it is not an integer.
std::int32_t factor_along(const ImageGeometry& finest, const ImageGeometry& coarse, std::size_t a) {
    constexpr double kSame = 1e-3;
    const double by_spacing = coarse.spacing[a] / finest.spacing[a];
    const double by_size = double(finest.size[a]) / coarse.size[a];
    const auto fits = [&](double factor) {
        // The last coarse voxel may cover fewer fine voxels than the others, or some fine voxels may not be covered.
        return factor >= 1 && std::abs(finest.size[a] - factor * coarse.size[a]) <= factor;
    };
    const double factor = std::round(by_spacing);
    if (std::abs(by_spacing - factor) < kSame * factor && fits(factor)) return std::int32_t(factor);
    // If a file does not state the spacing of coarser levels, it equals that of the finest level, and the factor
    // follows from the sizes.
    const double factor_by_size = std::exp2(std::round(std::log2(by_size)));
    return coarse.spacing[a] == finest.spacing[a] && fits(factor_by_size) ? std::int32_t(factor_by_size) : 0;
}

/// Copies `part` of a chunk into the contiguous `box`.
void copy_values(const detail::ChunkSource& source, const VoxelBox& part, const char* chunk, const VoxelBox& box,
                 float* out) {
    detail::with_pixel_type(source.type(), [&](auto pixel) {
        const auto* values = reinterpret_cast<const decltype(pixel)*>(chunk);
        const Index3 &size = source.chunk_size(), n = box.size();
        for (std::int32_t k = part.min[2]; k <= part.max[2]; ++k)
            for (std::int32_t j = part.min[1]; j <= part.max[1]; ++j) {
                const auto* from =
                    values + (std::int64_t(k % size[2]) * size[1] + j % size[1]) * size[0] + part.min[0] % size[0];
                float* to =
                    out + (std::int64_t(k - box.min[2]) * n[1] + (j - box.min[1])) * n[0] + (part.min[0] - box.min[0]);
                std::transform(from, from + part.size()[0], to, [](auto value) { return static_cast<float>(value); });
            }
    });
}

}  // namespace

ImageLevels::ImageLevels(Image image) : image_(std::move(image)) {
    levels_.push_back({image_.geometry().size, {1, 1, 1}});
}

ImageLevels::ImageLevels(Image image, const std::vector<Source>& sources, std::uint64_t max_bytes)
    : ImageLevels(std::move(image)) {
    cache_ = std::make_shared<detail::ChunkCache>(max_bytes);
    sources_.push_back(sources.front().chunks);
    for (std::size_t n = 1; n < sources.size(); ++n) {
        Level level{sources[n].geometry.size, {1, 1, 1}};
        for (std::size_t a = 0; a < 3; ++a)
            level.factor[a] = factor_along(sources.front().geometry, sources[n].geometry, a);
        bool is_coarser = level.factor != levels_.back().factor;
        for (std::size_t a = 0; a < 3; ++a) is_coarser = is_coarser && level.factor[a] >= levels_.back().factor[a];
        if (!is_coarser) continue;
        levels_.push_back(level);
        sources_.push_back(sources[n].chunks);
    }
}

bool ImageLevels::is_in_chunks() const noexcept { return cache_ != nullptr; }

Index3 ImageLevels::chunk_size(std::size_t level) const {
    return cache_ ? sources_[level]->chunk_size() : Index3{0, 0, 0};
}

std::size_t ImageLevels::level_for(int step) const {
    std::size_t best = 0;
    for (std::size_t n = 1; n < levels_.size(); ++n) {
        const Index3& factor = levels_[n].factor;
        if (std::all_of(factor.begin(), factor.end(), [&](std::int32_t f) { return step % f == 0; })) best = n;
    }
    return best;
}

void ImageLevels::copy(std::size_t level, const VoxelBox& box, float* out, const RunContext& run) const {
    if (!cache_) return image_.copy(box, out);
    const detail::ChunkSource& source = *sources_[level];
    const VoxelBox around = detail::chunks_around(box, source.chunk_size());
    const Index3 n = around.size();
    tbb::parallel_for(std::int64_t(0), std::int64_t(detail::voxel_count(n)), [&](std::int64_t at) {
        if (run.cancelled()) return;
        const Index3 chunk{around.min[0] + std::int32_t(at % n[0]), around.min[1] + std::int32_t(at / n[0] % n[1]),
                           around.min[2] + std::int32_t(at / n[0] / n[1])};
        const detail::ChunkCache::Chunk voxels = cache_->get(source, chunk);
        copy_values(source, detail::part_of(box, chunk, source.chunk_size()), voxels.get(), box, out);
    });
    run.check();
}

/// A sample of the image's values: all of its coarsest level, or 27 evenly spaced blocks of it if it is large.
std::vector<float> ImageLevels::overview(const RunContext& run) const {
    constexpr std::uint64_t kMaxVoxels = std::uint64_t(16) << 20;
    constexpr int kPlaces = 3, kBlock = 64;  // number of blocks along each axis, and their size in voxels
    const std::size_t level = levels_.size() - 1;
    const Index3& size = levels_[level].size;
    std::vector<float> values;
    const auto add = [&](const VoxelBox& box) {
        const std::size_t before = values.size();
        values.resize(before + detail::voxel_count(box.size()));
        copy(level, box, values.data() + before, run);
    };
    if (detail::voxel_count(size) <= kMaxVoxels) {
        add(detail::whole_box(size));
        return values;
    }
    for (int n = 0; n < kPlaces * kPlaces * kPlaces; ++n) {
        const std::array<int, 3> at{n % kPlaces, n / kPlaces % kPlaces, n / kPlaces / kPlaces};
        VoxelBox box;
        for (std::size_t a = 0; a < 3; ++a) {
            const auto middle = std::int32_t((2 * at[a] + 1) * std::int64_t(size[a]) / (2 * kPlaces));
            // Each block is within one chunk, so no more chunks are decoded than there are blocks.
            const std::int32_t chunk = sources_[level]->chunk_size()[a], first = middle / chunk * chunk;
            box.min[a] = std::max(first, middle - kBlock / 2);
            box.max[a] = std::min({first + chunk, box.min[a] + kBlock, size[a]}) - 1;
        }
        add(box);
    }
    return values;
}

std::array<double, 2> ImageLevels::range(const RunContext& run) const {
    if (!cache_) return image_.range();
    return detail::with_pixel_type(sources_.front()->type(), [&](auto pixel) -> std::array<double, 2> {
        using T = decltype(pixel);
        if constexpr (std::is_integral_v<T> && sizeof(T) <= 2)
            return {double(std::numeric_limits<T>::min()), double(std::numeric_limits<T>::max())};
        const std::vector<float> values = overview(run);
        const auto [low, high] = std::minmax_element(values.begin(), values.end());
        return {double(*low), double(*high)};
    });
}

std::array<double, 2> ImageLevels::percentiles(double low, double high, const RunContext& run) const {
    if (!cache_) return image_.percentiles(low, high);
    std::vector<float> values = overview(run);
    const auto value_at = [&](double fraction) {
        const auto nth = values.begin() + std::lround(std::clamp(fraction, 0.0, 1.0) * double(values.size() - 1));
        std::nth_element(values.begin(), nth, values.end());
        return double(*nth);
    };
    const double first = value_at(low);
    return {first, value_at(high)};
}

ImageLevels::CacheUse ImageLevels::cache() const {
    if (!cache_) return {};
    return {cache_->bytes(), cache_->max_bytes(), cache_->decoded()};
}

}  // namespace covol
