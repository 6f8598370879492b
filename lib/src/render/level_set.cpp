#include "render/level_set.h"

#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_reduce.h>

#include <cmath>

#include "base/geometry.h"
#include "covol/error.h"

namespace covol::figure {
namespace {

/// The extent of the surface: calls add(centre, extent) for the centre of each active voxel within a voxel of the
/// surface, in world coordinates. `add` converts the centre to the coordinates of the extent, and enlarges the extent
/// such that it contains the result. @throws Error InvalidInput if there is no such voxel
template <typename Add>
Extent extent_of(const FloatGrid& grid, const Add& add) {
    const openvdb::tree::LeafManager<const FloatGrid::TreeType> leaves(grid.tree());
    const auto near = float(grid.voxelSize()[0]);
    const auto& transform = grid.transform();
    Extent all = tbb::parallel_reduce(
        leaves.leafRange(), Extent{},
        [&](const auto& range, Extent extent) {
            for (auto leaf = range.begin(); leaf; ++leaf)
                for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel)
                    if (std::abs(*voxel) <= near) {
                        const openvdb::Vec3d at = transform.indexToWorld(voxel.getCoord());
                        add({at[0], at[1], at[2]}, extent);
                    }
            return extent;
        },
        [](Extent a, const Extent& b) {
            a.add(b);
            return a;
        });
    if (all.min[0] > all.max[0])
        throw Error(Errc::InvalidInput,
                    "render: grid '" + grid.getName() + "': expected voxels at a surface, got none");
    return all;
}

}  // namespace

SmoothField::SmoothField(const FloatGrid& grid)
    : transform_(grid.transform()), accessor_(grid.getConstAccessor()), h_(grid.voxelSize()[0]) {}

SmoothField::Weights SmoothField::weights(const Vec3& world) const {
    const openvdb::Vec3d index = transform_.worldToIndex(to_vdb(world));
    Weights w;
    for (int a = 0; a < 3; ++a) {
        const double base = std::floor(index[a]), t = index[a] - base, s = 1 - t;
        w.first[a] = int(base) - 1;
        w.value[a][0] = s * s * s / 6;
        w.value[a][1] = 2.0 / 3 - 0.5 * t * t * (2 - t);
        w.value[a][2] = 2.0 / 3 - 0.5 * s * s * (2 - s);
        w.value[a][3] = t * t * t / 6;
        w.slope[a][0] = -0.5 * s * s;
        w.slope[a][1] = 1.5 * t * t - 2 * t;
        w.slope[a][2] = 2 * s - 1.5 * s * s;
        w.slope[a][3] = 0.5 * t * t;
    }
    return w;
}

SmoothField::Sample SmoothField::at(const Vec3& world) {
    const Weights w = weights(world);
    double value = 0, slope[3] = {0, 0, 0};
    openvdb::Coord at;
    for (int i = 0; i < 4; ++i) {
        at[0] = w.first[0] + i;
        double row = 0, row_y = 0, row_z = 0;
        for (int j = 0; j < 4; ++j) {
            at[1] = w.first[1] + j;
            double line = 0, line_z = 0;
            for (int k = 0; k < 4; ++k) {
                at[2] = w.first[2] + k;
                const double v = accessor_.getValue(at);
                line += w.value[2][k] * v;
                line_z += w.slope[2][k] * v;
            }
            row += w.value[1][j] * line;
            row_y += w.slope[1][j] * line;
            row_z += w.value[1][j] * line_z;
        }
        value += w.value[0][i] * row;
        slope[0] += w.slope[0][i] * row;
        slope[1] += w.value[0][i] * row_y;
        slope[2] += w.value[0][i] * row_z;
    }
    return {value, {slope[0] / h_, slope[1] / h_, slope[2] / h_}};
}

double SmoothField::value(const Vec3& world) {
    float nearest = 0;
    const openvdb::Coord at = openvdb::Coord::round(transform_.worldToIndex(to_vdb(world)));
    if (!accessor_.probeValue(at, nearest)) return nearest;
    return this->at(world).value;
}

WorldBox surface_box(const FloatGrid& grid) {
    if (!grid.hasUniformVoxels())
        throw Error(Errc::InvalidInput, "render: grid '" + grid.getName() + "': expected voxels that are cubes");
    const Extent e = extent_of(grid, [](const Vec3& at, Extent& extent) { extent.add(at[0], at[1], at[2]); });
    return {{e.min[0], e.min[1], e.min[2]}, {e.max[0], e.max[1], e.max[2]}};
}

Extent surface_extent(const FloatGrid& grid, const Basis& basis) {
    return extent_of(grid, [&](const Vec3& at, Extent& extent) {
        extent.add(dot(at, basis.right), dot(at, basis.up), dot(at, basis.to_eye));
    });
}

Extent turning_extent(const FloatGrid& grid, const Vec3& center, double elevation) {
    const Basis level = view_basis(0, elevation);
    return extent_of(grid, [&](const Vec3& at, Extent& extent) {
        const Vec3 away = minus(at, center);
        const double r = std::hypot(away[0], away[1]);
        const double up = std::abs(away[2] * level.up[2]) + r * std::abs(level.up[1]);
        const double deep = std::abs(away[2] * level.to_eye[2]) + r * std::abs(level.to_eye[1]);
        for (const double sign : {-1.0, 1.0}) extent.add(sign * r, sign * up, sign * deep);
    });
}

}  // namespace covol::figure
