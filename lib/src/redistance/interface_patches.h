#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "covol/domain.h"
#include "covol/run.h"
#include "grid/leaf_band.h"
#include "redistance/patch_kernel.h"

namespace covol::detail {

/// A polygon of the zero level set in one cell (the cube between eight voxel centres), as a fan of triangles around
/// its centre. Lengths are voxels, positions are relative to `origin`, the cell's first voxel.
struct Patch {
    Coord origin;
    std::array<float, 3> center;
    std::array<float, 3> normal;  ///< unit; of the whole polygon
    float radius;                 ///< maximum distance of a vertex from the axis (center, normal)
    float height;                 ///< maximum distance of a vertex from the plane through the center
    std::uint32_t first;          ///< its vertices are InterfacePatches::vertices [first, first + count)
    std::uint32_t count;
};

/// The zero level set for linear interpolation along the voxel edges, cell by cell. A cell belongs to the leaf that
/// contains its first voxel.
struct InterfacePatches {
    std::vector<Coord> leaves;         ///< sorted origins of the leaves with patches
    std::vector<std::uint32_t> first;  ///< leaf i has the patches [first[i], first[i+1])
    std::vector<Patch> patches;        ///< ordered by leaf, then by cell
    std::vector<std::array<float, 3>> vertices;

    [[nodiscard]] PatchOutline outline(const Patch& patch) const {
        return {patch.normal.data(), patch.center.data(), vertices.data() + patch.first, static_cast<int>(patch.count)};
    }
    /// Squared distance from the centre of voxel `at` to the patch; infinite if it is not below `bound`.
    [[nodiscard]] PatchHit nearest(const Coord& at, const Patch& patch, float bound) const;
};

/// Treatment of a surface that reaches the domain's boundary.
enum class DomainEnd {
    Closed,  ///< everything beyond is outside: the surface is closed half a voxel beyond the last voxel centres
    Open     ///< the surface ends at the boundary
};

/// Finds the patches of u; negative is inside.
[[nodiscard]] InterfacePatches find_interface(const FloatGrid& u, const Domain& domain, DomainEnd end,
                                              const RunContext& run);

}  // namespace covol::detail
