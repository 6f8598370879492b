#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "covol/fwd.h"

namespace covol::detail {

/// Values on a small box of voxels, k fastest.
template <typename T>
struct DenseVolume {
    Index3 size{0, 0, 0};
    std::vector<T> values;

    DenseVolume() = default;
    DenseVolume(const Index3& extent, T fill)
        : size(extent), values(std::size_t(extent[0]) * std::size_t(extent[1]) * std::size_t(extent[2]), fill) {}
    [[nodiscard]] std::size_t at(int i, int j, int k) const {
        return (std::size_t(i) * std::size_t(size[1]) + std::size_t(j)) * std::size_t(size[2]) + std::size_t(k);
    }
    [[nodiscard]] bool contains(int i, int j, int k) const {
        return i >= 0 && j >= 0 && k >= 0 && i < size[0] && j < size[1] && k < size[2];
    }
    [[nodiscard]] Index3 voxel(std::size_t n) const {
        const std::size_t row = n / std::size_t(size[2]);
        return {int(row / std::size_t(size[1])), int(row % std::size_t(size[1])), int(n % std::size_t(size[2]))};
    }
    /// visit(index) for the neighbours through a face.
    template <typename Visit>
    void neighbours(std::size_t n, Visit visit) const {
        const Index3 v = voxel(n);
        const std::size_t step[3] = {std::size_t(size[1]) * std::size_t(size[2]), std::size_t(size[2]), 1};
        for (int a = 0; a < 3; ++a) {
            if (v[a] > 0) visit(n - step[a]);
            if (v[a] + 1 < size[a]) visit(n + step[a]);
        }
    }
};

using DenseMask = DenseVolume<std::uint8_t>;

/// Exact squared distance, in voxels, from each centre to the nearest voxel where `mask` is `value` (Felzenszwalb and
/// Huttenlocher 2012: lower envelopes of parabolas, axis by axis); kNowhere where there is none.
[[nodiscard]] DenseVolume<float> squared_distance(const DenseMask& mask, bool value);
inline constexpr float kNowhere = 1e12F;

}  // namespace covol::detail
