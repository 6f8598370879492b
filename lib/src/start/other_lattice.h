#pragma once
// Reads a level set of another lattice on the lattice of a domain.
#include <openvdb/openvdb.h>

#include <array>
#include <functional>
#include <optional>

#include "covol/domain.h"
#include "covol/fwd.h"

namespace covol::detail {

/// Values of a field at the voxels lo..hi of the domain's lattice, k fastest; negative is inside.
using Sampler = std::function<void(const openvdb::Coord& lo, const openvdb::Coord& hi, float* values)>;

/// Maps voxels of a domain to the index space of a source grid with a linear transform.
class ToSource {
public:
    ToSource(const Domain& domain, const openvdb::math::Transform& source);
    openvdb::Vec3d operator()(int i, int j, int k) const {
        return from_ + double(i) * along_[0] + double(j) * along_[1] + double(k) * along_[2];
    }
    /// The difference between the indices of a voxel in the source and in the domain, if the lattices coincide.
    [[nodiscard]] std::optional<openvdb::Coord> shift() const;
    /// The source's voxels that interpolation at the voxels lo..hi reads.
    [[nodiscard]] openvdb::CoordBBox box(const openvdb::Coord& lo, const openvdb::Coord& hi) const;

private:
    openvdb::Vec3d from_;
    std::array<openvdb::Vec3d, 3> along_;
};

/// Whether the surface may cross the box: false if all values in the box have the same sign. For boxes larger than a
/// leaf with its next layer the result is true without a test, which would take longer than it may save.
[[nodiscard]] bool may_cross(const FloatGrid& grid, const openvdb::CoordBBox& box);

/// Samples the grid on the domain's lattice: its own values if the lattices coincide, otherwise trilinearly
/// interpolated ones. Both arguments are kept by reference.
[[nodiscard]] Sampler sampler_of(const FloatGrid& grid, const ToSource& to_source);

}  // namespace covol::detail
