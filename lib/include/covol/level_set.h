#pragma once
#include <span>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/mesh.h"
#include "covol/run.h"

namespace covol {

/// A closed surface, stored as its signed distance: the grid is an OpenVDB level set in world units, negative inside,
/// with cubic voxels; farther than kHalfWidthVoxels voxels from the surface, its value is +-kHalfWidthVoxels voxels.
/// Copies of this object share the grid, which is never modified.
class LevelSet {
public:
    /// Computes the signed distance to the zero level set of any grid that is negative inside.
    /// @throws Error InvalidInput (no zero crossing; voxels that are not cubes), Cancelled.
    [[nodiscard]] COVOL_API static LevelSet from(const FloatGrid& u, const RunContext& run = {});
    /// Uses a grid that already is such a signed distance, as from extract_surface() and the functions
    /// start_from_...().
    /// @throws Error InvalidInput (null, another class of grid, another background, voxels that are not cubes).
    COVOL_API explicit LevelSet(FloatGridPtr distance);

    [[nodiscard]] const FloatGrid& grid() const { return *grid_; }
    /// The grid as a pointer; the grid must not be modified through it.
    [[nodiscard]] const FloatGridPtr& pointer() const { return grid_; }
    [[nodiscard]] COVOL_API Domain domain() const;

    /// Distances from positions to the surface, trilinear between voxels, negative inside, limited to the half width of
    /// the band. @param places  positions, world units
    [[nodiscard]] COVOL_API std::vector<double> sample(std::span<const Vec3> places) const;
    [[nodiscard]] COVOL_API double sample(const Vec3& place) const;

    /// The surface moved outward by `distance` world units along its normals, inward if it is < 0, up to the domain's
    /// end.
    /// @throws Error InvalidInput (nothing remains), InvalidOptions (not finite), Cancelled.
    [[nodiscard]] COVOL_API LevelSet offset(double distance, const RunContext& run = {}) const;
    /// The union or intersection of this and the other solid, or this solid without the other, on this lattice and
    /// domain.
    /// @throws Error InvalidInput (nothing remains), Cancelled.
    [[nodiscard]] COVOL_API LevelSet united(const LevelSet& other, const RunContext& run = {}) const;
    [[nodiscard]] COVOL_API LevelSet intersected(const LevelSet& other, const RunContext& run = {}) const;
    [[nodiscard]] COVOL_API LevelSet without(const LevelSet& other, const RunContext& run = {}) const;

    /// Properties of the surface's triangle mesh, which is not stored.
    [[nodiscard]] COVOL_API MeshMeasures measure(const RunContext& run = {}) const;

private:
    FloatGridPtr grid_;
};

}  // namespace covol
