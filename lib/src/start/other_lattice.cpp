#include "start/other_lattice.h"

#include <openvdb/tools/Dense.h>
#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <vector>

namespace covol::detail {
namespace {

using openvdb::Coord;

void copy_block(const FloatGrid& grid, const openvdb::CoordBBox& box, float* values) {
    openvdb::tools::Dense<float> dense(box, values);
    openvdb::tools::copyToDense(grid, dense, true);
}

/// The values of a box of voxels, k fastest.
class DenseBlock {
public:
    DenseBlock(const FloatGrid& grid, const openvdb::CoordBBox& box) : size_(box.dim()), values_(box.volume()) {
        copy_block(grid, box, values_.data());
    }
    [[nodiscard]] bool is_mixed() const {
        return std::any_of(values_.begin(), values_.end(), [&](float v) { return (v < 0) != (values_[0] < 0); });
    }
    /// The trilinearly interpolated value. @param at  position in voxels from the block's first one
    [[nodiscard]] float sample(const openvdb::Vec3d& at) const {
        int base[3];
        float part[3];
        for (int a = 0; a < 3; ++a) {
            base[a] = std::clamp(int(at[a]), 0, size_[a] - 2);
            part[a] = float(at[a] - base[a]);
        }
        const std::ptrdiff_t j = size_.z(), i = j * size_.y();
        const float* p = values_.data() + base[0] * i + base[1] * j + base[2];
        const auto along_k = [&](const float* q) { return q[0] + part[2] * (q[1] - q[0]); };
        const auto across = [&](const float* q) {
            const float first = along_k(q);
            return first + part[1] * (along_k(q + j) - first);
        };
        const float first = across(p);
        return first + part[0] * (across(p + i) - first);
    }

private:
    Coord size_;
    std::vector<float> values_;
};

Sampler between_voxels(const FloatGrid& grid, const ToSource& to_source) {
    constexpr openvdb::Index64 kMaxCopied = 24 * 24 * 24;
    return [&](const Coord& lo, const Coord& hi, float* values) {
        const auto for_all = [&](const auto& sample) {
            for (int i = lo.x(); i <= hi.x(); ++i)
                for (int j = lo.y(); j <= hi.y(); ++j)
                    for (int k = lo.z(); k <= hi.z(); ++k) *values++ = sample(to_source(i, j, k));
        };
        const openvdb::CoordBBox box = to_source.box(lo, hi);
        if (box.volume() <= kMaxCopied) {
            const DenseBlock block(grid, box);
            for_all([&, first = box.min().asVec3d()](const openvdb::Vec3d& at) { return block.sample(at - first); });
        } else {
            const auto accessor = grid.getConstAccessor();
            for_all([&](const openvdb::Vec3d& at) { return openvdb::tools::BoxSampler::sample(accessor, at); });
        }
    };
}

}  // namespace

ToSource::ToSource(const Domain& domain, const openvdb::math::Transform& source) {
    const auto index_of = [&](const Vec3& at) {
        const Vec3 x = domain.index_to_world(at);
        return source.worldToIndex(openvdb::Vec3d(x[0], x[1], x[2]));
    };
    from_ = index_of({0, 0, 0});
    along_ = {index_of({1, 0, 0}) - from_, index_of({0, 1, 0}) - from_, index_of({0, 0, 1}) - from_};
}

std::optional<Coord> ToSource::shift() const {
    constexpr double kSame = 1e-9;  // maximum deviation of the lattices, voxels per voxel of distance
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
            if (std::abs(along_[std::size_t(a)][b] - (a == b ? 1 : 0)) > kSame) return std::nullopt;
    const Coord nearest = Coord::round(from_);
    return (from_ - nearest.asVec3d()).length() < 1e3 * kSame ? std::optional(nearest) : std::nullopt;
}

openvdb::CoordBBox ToSource::box(const Coord& lo, const Coord& hi) const {
    openvdb::BBoxd corners;
    for (int c = 0; c < 8; ++c)
        corners.expand((*this)(c & 4 ? hi.x() : lo.x(), c & 2 ? hi.y() : lo.y(), c & 1 ? hi.z() : lo.z()));
    return {Coord::floor(corners.min()), Coord::floor(corners.max()).offsetBy(1)};
}

bool may_cross(const FloatGrid& grid, const openvdb::CoordBBox& box) {
    return box.volume() > 9 * 9 * 9 || DenseBlock(grid, box).is_mixed();
}

Sampler sampler_of(const FloatGrid& grid, const ToSource& to_source) {
    const std::optional<Coord> shift = to_source.shift();
    if (!shift) return between_voxels(grid, to_source);
    return [&grid, shift](const Coord& lo, const Coord& hi, float* values) {
        copy_block(grid, {*shift + lo, *shift + hi}, values);
    };
}

}  // namespace covol::detail
