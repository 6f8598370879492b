#pragma once
// A level set between its voxels.
#include <openvdb/openvdb.h>

#include <vector>

#include "covol/fwd.h"
#include "render/draw/camera.h"

namespace covol::figure {

inline openvdb::Vec3d to_vdb(const Vec3& v) { return {v[0], v[1], v[2]}; }

/// The cubic B-spline whose coefficients are the voxels: two times differentiable, so that normals show no voxels. It
/// lies h/(3R) voxels inside of a ball of radius R. For one thread.
class SmoothField {
public:
    explicit SmoothField(const FloatGrid& grid);
    struct Sample {
        double value;   ///< world units
        Vec3 gradient;  ///< world
    };
    [[nodiscard]] Sample at(const Vec3& world);
    /// The value alone; away from the band that of the nearest voxel.
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

/// The corners of the world box of the voxels inside or near the surface. @throws Error InvalidInput where there are
/// none, or the voxels are no cubes.
[[nodiscard]] WorldBox surface_box(const FloatGrid& grid);

/// How far the surface reaches.
[[nodiscard]] Extent surface_extent(const FloatGrid& grid, const Basis& basis);
/// How far it reaches from `center` when it is turned about the vertical axis through it, seen from that elevation.
[[nodiscard]] Extent turning_extent(const FloatGrid& grid, const Vec3& center, double elevation);

}  // namespace covol::figure
