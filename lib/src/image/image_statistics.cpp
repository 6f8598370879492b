// Statistics of an image's values.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "covol/image.h"
#include "io/pixels/chunks.h"

namespace covol {
namespace {

struct MinMax {
    double min = std::numeric_limits<double>::infinity();
    double max = -std::numeric_limits<double>::infinity();
    bool finite = true;

    void add(const MinMax& o) {
        min = std::min(min, o.min);
        max = std::max(max, o.max);
        finite = finite && o.finite;
    }
};

template <typename T>
MinMax scan_row(const T* row, std::int32_t count, std::int64_t stride) {
    T lo = std::numeric_limits<T>::max();
    T hi = std::numeric_limits<T>::lowest();
    bool finite = true;
    for (std::int64_t n = 0; n < count; ++n) {
        const T value = row[n * stride];
        lo = std::min(lo, value);
        hi = std::max(hi, value);
        if constexpr (std::is_floating_point_v<T>) finite = finite && std::isfinite(value);
    }
    return {double(lo), double(hi), finite};
}

/// Calls visit(k) for `count` evenly spaced slices in parallel, and combines the results.
template <typename Visit>
MinMax scan_slices(const VoxelBox& box, int count, const Visit& visit) {
    std::vector<MinMax> slices(std::size_t(std::max(count, 0)));
    const auto steps = std::int64_t(std::max(count, 2) - 1);
    tbb::parallel_for(std::size_t(0), slices.size(), [&](std::size_t n) {
        slices[n] = visit(box.min[2] + int(std::int64_t(n) * (box.size()[2] - 1) / steps));
    });
    MinMax all;
    for (const MinMax& slice : slices) all.add(slice);
    return all;
}

constexpr double kSamples = 4e6;  ///< maximum number of values from which percentiles are computed
/// [bytes] Amount that range() reads from a mapped file, which takes one or two seconds.
constexpr double kQuickBytes = 1 << 28;

}  // namespace

template <typename T>
std::vector<T> Image::values_of_chunks(double maximum) const {
    const VoxelBox held = in_file(held_);
    std::vector<VoxelBox> boxes;
    const auto add = [&](std::uint64_t chunk) {
        VoxelBox box = chunks_->box_of(chunk);
        bool empty = false;
        for (int a = 0; a < 3; ++a) {
            box.min[a] = std::max(box.min[a], held.min[a]);
            box.max[a] = std::min(box.max[a], held.max[a]);
            empty = empty || box.min[a] > box.max[a];
        }
        if (!empty) boxes.push_back(box);
    };
    for (const std::uint64_t chunk : chunks_->read_chunks()) add(chunk);
    if (boxes.empty()) {
        constexpr int kPlaces = 3;  // number of sampled chunks along each axis
        std::vector<VoxelBox> places;
        for (int n = 0; n < kPlaces * kPlaces * kPlaces; ++n) {
            Index3 voxel;
            for (const auto& [a, at] : {std::pair{0, n % 3}, std::pair{1, n / 3 % 3}, std::pair{2, n / 9}})
                voxel[a] = held.min[a] + std::int32_t((2 * at + 1) * std::int64_t(held.size()[a]) / (2 * kPlaces));
            places.push_back({voxel, voxel});
        }
        chunks_->load(places, {});
        for (const std::uint64_t chunk : chunks_->read_chunks()) add(chunk);
    }
    double voxels = 0;
    for (const VoxelBox& box : boxes) voxels += double(detail::voxel_count(box.size()));
    const auto step = static_cast<std::size_t>(std::max(1.0, std::ceil(voxels / maximum)));
    std::vector<T> values, part;
    std::size_t next = 0;  // index of the next sample in the current box; continues through all boxes
    for (const VoxelBox& box : boxes) {
        part.resize(detail::voxel_count(box.size()));
        chunks_->copy(box, part.data());
        for (; next < part.size(); next += step) values.push_back(part[next]);
        next -= part.size();
    }
    return values;
}

template <typename T>
const T* Image::row(int j, int k) const {
    return static_cast<const T*>(data_.get()) + stride_[1] * (j - held_.min[1]) + stride_[2] * (k - held_.min[2]);
}

std::uint64_t Image::slice_bytes() const {
    // The bytes from the first held pixel of a slice to the last one.
    const Index3 n = held_.size();
    return (std::uint64_t(stride_[1]) * std::uint64_t(n[1] - 1) + std::uint64_t(stride_[0]) * std::uint64_t(n[0] - 1) +
            1) *
           detail::pixel_bytes(type_);
}

void Image::expect_slice(int k) const {
    if (!mapped_) return;
    detail::with_pixel_type(
        type_, [&](auto pixel) { detail::prefetch_pages(row<decltype(pixel)>(held_.min[1], k), slice_bytes()); });
}

void Image::forget_slice(int k) const {
    if (!mapped_) return;
    detail::with_pixel_type(
        type_, [&](auto pixel) { detail::release_pages(row<decltype(pixel)>(held_.min[1], k), slice_bytes()); });
}

void Image::release() const {
    if (!mapped_) return;
    const auto slices = std::uint64_t(stride_[2]) * std::uint64_t(held_.size()[2] - 1) * detail::pixel_bytes(type_);
    detail::release_pages(data_.get(), slices + slice_bytes());
}

std::array<double, 2> Image::percentiles(double low, double high) const {
    const double ratio = double(detail::voxel_count(held_.size())) / kSamples;
    const auto step = static_cast<std::int32_t>(std::max(1.0, std::ceil(std::cbrt(ratio))));
    return detail::with_pixel_type(type_, [&](auto pixel) {
        using T = decltype(pixel);
        std::vector<T> values;
        if (chunks_) values = values_of_chunks<T>(kSamples);
        const Index3 n = held_.size();
        for (std::int32_t k = 0; !chunks_ && k < n[2]; k += step) {
            for (std::int32_t j = 0; j < n[1]; j += step) {
                const T* line = row<T>(held_.min[1] + j, held_.min[2] + k);
                for (std::int64_t i = 0; i < n[0]; i += step) values.push_back(line[i * stride_[0]]);
            }
            forget_slice(held_.min[2] + k);
        }
        const auto value_at = [&](double fraction) {
            const double place = std::clamp(fraction, 0.0, 1.0) * double(values.size() - 1);
            const auto nth = values.begin() + static_cast<std::ptrdiff_t>(std::lround(place));
            std::nth_element(values.begin(), nth, values.end());
            return double(*nth);
        };
        const double first = value_at(low);
        return std::array<double, 2>{first, value_at(high)};
    });
}

std::array<double, 2> Image::range() const {
    const double all_slices = held_.size()[2];
    const int slices = mapped_
                           ? int(std::clamp(kQuickBytes / double(slice_bytes()), std::min(3.0, all_slices), all_slices))
                           : held_.size()[2];
    return detail::with_pixel_type(type_, [&](auto pixel) {
        if (chunks_) {
            const auto values = values_of_chunks<decltype(pixel)>(std::numeric_limits<double>::infinity());
            const auto [low, high] = std::minmax_element(values.begin(), values.end());
            return std::array<double, 2>{double(*low), double(*high)};
        }
        const MinMax all = scan_slices(held_, slices, [&](int k) {
            MinMax slice;
            expect_slice(k);
            for (int j = held_.min[1]; j <= held_.max[1]; ++j)
                slice.add(scan_row(row<decltype(pixel)>(j, k), held_.size()[0], stride_[0]));
            forget_slice(k);
            return slice;
        });
        return std::array<double, 2>{all.min, all.max};
    });
}

void Image::require_finite() const {
    if (chunks_) return;  // each chunk is checked when it is read
    detail::with_pixel_type(type_, [&](auto pixel) {
        using T = decltype(pixel);
        if constexpr (std::is_floating_point_v<T>) {
            const auto slice_is_finite = [&](int k) {
                MinMax slice;
                expect_slice(k);
                for (int j = held_.min[1]; j <= held_.max[1]; ++j)
                    slice.add(scan_row(row<T>(j, k), held_.size()[0], stride_[0]));
                forget_slice(k);
                return slice;
            };
            if (scan_slices(held_, held_.size()[2], slice_is_finite).finite) return;
            for (int k = held_.min[2]; k <= held_.max[2]; ++k)
                for (int j = held_.min[1]; j <= held_.max[1]; ++j)
                    for (int i = held_.min[0]; i <= held_.max[0]; ++i)
                        if (!std::isfinite(at(i, j, k)))
                            throw detail::not_finite(path_.empty() ? "image" : path_, {i, j, k});
        }
    });
}

}  // namespace covol
