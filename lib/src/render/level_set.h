#pragma once
// Interpolation of a level set between its voxels.
#include <openvdb/openvdb.h>

#include <vector>

#include "covol/fwd.h"
#include "render/draw/camera.h"

namespace covol::figure {

inline openvdb::Vec3d to_vdb(const Vec3& v) { return {v[0], v[1], v[2]}; }

/// The cubic B-spline whose coefficients are the voxels: twice differentiable, so that normals do not show the voxels.
/// It smooths the level set: its zero lies h/(3R) voxels inside the surface of a ball of radius R, where h is the voxel
/// size. For one thread.
class SmoothField {
public:
    explicit SmoothField(const FloatGrid& grid);
    struct Sample {
        double value;   ///< world units
        Vec3 gradient;  ///< with respect to world coordinates
    };
    [[nodiscard]] Sample at(const Vec3& world);
    /// The value without the gradient; if the nearest voxel is inactive, as outside the band, that voxel's value.
    [[nodiscard]] double value(const Vec3& world);
    [[nodiscard]] double voxel_size() const { return h_; }

private:
    struct Weights {
        openvdb::Coord first;
        double value[3][4], slope[3][4];
    };
    [[nodiscard]] Weights weights(const Vec3& world) const;

    const openvdb::math::Transform& transform_;
    FloatGrid::ConstAccessor accessor_;
    double h_;
};

/// The world box of the centres of voxels within a voxel of the surface.
/// @throws Error InvalidInput if there are none, or the voxels are not cubes.
[[nodiscard]] WorldBox surface_box(const FloatGrid& grid);

/// The extent, along the axes of a basis, of the centres of voxels within a voxel of the surface.
[[nodiscard]] Extent surface_extent(const FloatGrid& grid, const Basis& basis);
/// The extent, relative to `center`, of all rotations of the surface about the z axis through `center`, seen from an
/// elevation in degrees.
[[nodiscard]] Extent turning_extent(const FloatGrid& grid, const Vec3& center, double elevation);

}  // namespace covol::figure
