// Resampling of images on other lattices.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/matrix.h"
#include "covol/error.h"
#include "covol/image.h"
#include "io/pixels/chunks.h"

namespace covol {
namespace {

/// image index = matrix * frame index + offset
struct LatticeMap {
    Matrix3 matrix{};
    Vec3 offset{};
    std::array<int, 3> image_axis{-1, -1, -1};  ///< if separable, the image axis parallel to each frame axis
    bool separable = true;
};

LatticeMap map_lattice(const ImageGeometry& geometry, const Domain& frame) {
    LatticeMap map;
    map.offset = geometry.world_to_index(frame.origin);
    const Matrix3 to_axes = detail::inverse(geometry.direction);
    constexpr double kSmall = 1e-6;
    for (int a = 0; a < 3; ++a) {
        int used = 0;
        for (int b = 0; b < 3; ++b) {
            map.matrix[a][b] = to_axes[a][b] * frame.voxel_size / geometry.spacing[a];
            if (std::abs(to_axes[a][b]) < kSmall) continue;
            ++used;
            map.image_axis[b] = a;
        }
        map.separable = map.separable && used == 1;
    }
    return map;
}

/// Linear interpolation along one axis: (1-weight) * data[offset] + weight * data[offset + step].
struct Tap {
    std::int64_t offset = 0;
    std::int64_t step = 0;  ///< 0 if the position is a voxel's centre or outside of the image
    double weight = 0;
};

/// An axis of the image: number of voxels, index of the first voxel in memory, and distance between neighbouring voxels
/// in memory, counted in values.
struct Axis {
    std::int32_t size = 0;
    std::int32_t first = 0;
    std::int64_t stride = 0;
};
using Lattice = std::array<Axis, 3>;

// [voxels] Positions that are closer than this to a voxel's centre count as the centre, because two lattices that
// should coincide may differ by the rounding of the spacing in a file.
constexpr double kSame = 1e-4;

Tap make_tap(double position, const Axis& axis) {
    const double clamped = std::clamp(position, 0.0, double(axis.size - 1));
    const auto below = static_cast<std::int64_t>(clamped);
    const double weight = clamped - double(below);
    const std::int64_t offset = (below - axis.first) * axis.stride;
    if (weight < kSame) return {offset, 0, 0};
    if (weight > 1 - kSame) return {offset + axis.stride, 0, 0};
    return {offset, axis.stride, weight};
}

/// Type for interpolation: single precision if it represents every value of T.
template <typename T>
using Work = std::conditional_t<sizeof(T) <= 2 || std::is_same_v<T, float>, float, double>;

template <typename T>
Work<T> interpolate(const T* data, const Tap& x, const Tap& y, const Tap& z) {
    using W = Work<T>;
    const auto along_x = [&](const T* p) { return W(p[0]) + W(x.weight) * (W(p[x.step]) - W(p[0])); };
    const auto along_xy = [&](const T* p) {
        const W first = along_x(p);
        return y.step == 0 ? first : first + W(y.weight) * (along_x(p + y.step) - first);
    };
    const T* p = data + x.offset + y.offset + z.offset;
    const W first = along_xy(p);
    return z.step == 0 ? first : first + W(z.weight) * (along_xy(p + z.step) - first);
}

/// Samples at the indices min to max of the frame, if each of its axes is parallel to one of the image's: taps are then
/// computed once for each index along an axis instead of for each sample.
template <typename T>
void sample_separable(const T* data, const Lattice& image, const LatticeMap& map, const Index3& min, const Index3& max,
                      float* out) {
    std::array<std::vector<Tap>, 3> taps;
    for (int b = 0; b < 3; ++b) {
        const int a = map.image_axis[b];
        taps[b].reserve(static_cast<std::size_t>(max[b] - min[b] + 1));
        for (std::int32_t n = min[b]; n <= max[b]; ++n)
            taps[b].push_back(make_tap(map.matrix[a][b] * n + map.offset[a], image[a]));
    }
    const auto on_centres = [](const std::vector<Tap>& t) {
        return std::all_of(t.begin(), t.end(), [](const Tap& tap) { return tap.step == 0; });
    };
    const bool copy = on_centres(taps[0]) && on_centres(taps[1]) && on_centres(taps[2]);
    for (const Tap& i : taps[0])
        for (const Tap& j : taps[1]) {
            if (copy) {
                const T* row = data + i.offset + j.offset;
                for (const Tap& k : taps[2]) *out++ = static_cast<float>(row[k.offset]);
            } else {
                for (const Tap& k : taps[2]) *out++ = static_cast<float>(interpolate(data, k, i, j));
            }
        }
}

template <typename T>
void sample_affine(const T* data, const Lattice& image, const LatticeMap& map, const Index3& min, const Index3& max,
                   float* out) {
    for (std::int32_t i = min[0]; i <= max[0]; ++i)
        for (std::int32_t j = min[1]; j <= max[1]; ++j) {
            const Vec3 row = detail::multiply(map.matrix, {double(i), double(j), 0});
            for (std::int32_t k = min[2]; k <= max[2]; ++k) {
                const auto tap = [&](int a) {
                    return make_tap(row[a] + map.matrix[a][2] * k + map.offset[a], image[a]);
                };
                *out++ = static_cast<float>(interpolate(data, tap(0), tap(1), tap(2)));
            }
        }
}

/// The voxels that are needed for samples at the indices min to max of the frame. An affine map has its extremes at the
/// corners of this box.
VoxelBox needed_voxels(const LatticeMap& map, const Index3& size, const Index3& min, const Index3& max) {
    VoxelBox box;
    for (int a = 0; a < 3; ++a) {
        double lo = map.offset[a], hi = map.offset[a];
        for (int b = 0; b < 3; ++b) {
            const double at_min = map.matrix[a][b] * min[b], at_max = map.matrix[a][b] * max[b];
            lo += std::min(at_min, at_max);
            hi += std::max(at_min, at_max);
        }
        box.min[a] = static_cast<std::int32_t>(std::floor(std::clamp(lo + kSame, 0.0, double(size[a] - 1))));
        box.max[a] = static_cast<std::int32_t>(std::ceil(std::clamp(hi - kSame, 0.0, double(size[a] - 1))));
    }
    return box;
}

}  // namespace

void Image::load(const Domain& frame, const std::vector<VoxelBox>& boxes, const RunContext& run) const {
    if (!chunks_) return;
    const LatticeMap map = map_lattice(geometry_, frame);
    std::vector<VoxelBox> needed;
    for (const VoxelBox& box : boxes) {
        const VoxelBox part = needed_voxels(map, geometry_.size, box.min, box.max);
        // A part that is not held entirely is not loaded, because sample() throws an error for it.
        if (held_.contains(part.min) && held_.contains(part.max)) needed.push_back(in_file(part));
    }
    with_threads(run, [&] { chunks_->load(needed, run); });
}

void Image::load(const std::vector<Vec3>& places, const RunContext& run) const {
    if (!chunks_) return;
    std::vector<VoxelBox> needed;
    for (const Vec3& place : places) {
        Domain frame;
        frame.origin = place;
        const VoxelBox part = needed_voxels(map_lattice(geometry_, frame), geometry_.size, {0, 0, 0}, {0, 0, 0});
        if (held_.contains(part.min) && held_.contains(part.max)) needed.push_back(in_file(part));
    }
    with_threads(run, [&] { chunks_->load(needed, run); });
}

void Image::load(const VoxelBox& box, const RunContext& run) const {
    if (chunks_) with_threads(run, [&] { chunks_->load({in_file(box)}, run); });
}

void Image::sample(const Domain& frame, const Index3& min, const Index3& max, float* out) const {
    const LatticeMap map = map_lattice(geometry_, frame);
    VoxelBox box = held_;
    if (chunks_ || held_ != detail::whole_box(geometry_.size)) {
        const VoxelBox needed = needed_voxels(map, geometry_.size, min, max);
        if (!held_.contains(needed.min) || !held_.contains(needed.max))
            throw Error(Errc::InvalidInput,
                        (path_.empty() ? "image" : path_) +
                            ": voxels outside the part that was read are needed; choose a larger `roi`",
                        "roi");
        if (chunks_) box = needed;
    }
    detail::with_pixel_type(type_, [&](auto pixel) {
        using T = decltype(pixel);
        const T* data = static_cast<const T*>(data_.get());
        std::array<std::int64_t, 3> stride = stride_;
        std::vector<T> copied;
        if (chunks_) {
            copied.resize(detail::voxel_count(box.size()));
            chunks_->copy(in_file(box), copied.data());
            data = copied.data();
            stride = detail::dense_strides(box.size());
        }
        Lattice lattice;
        for (int a = 0; a < 3; ++a) lattice[a] = {geometry_.size[a], box.min[a], stride[a]};
        if (map.separable)
            sample_separable(data, lattice, map, min, max, out);
        else
            sample_affine(data, lattice, map, min, max, out);
    });
}

}  // namespace covol
