#pragma once
#include <span>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/mesh.h"
#include "covol/run.h"

namespace covol {

/// A closed surface, kept as its signed distance: the grid is a level set of OpenVDB's, in world units, negative
/// inside, with cubic voxels, and outside of a band of kHalfWidthVoxels voxels on both sides of the surface it is
/// +-kHalfWidth voxels. A value: copies share the grid, and nothing writes to it.
class LevelSet {
public:
    /// The zero level set of any grid that is negative inside; its distance is made exact.
    /// @throws Error InvalidInput (no zero crossing; voxels that are no cubes), Cancelled.
    [[nodiscard]] COVOL_API static LevelSet from(const FloatGrid& u, const RunContext& run = {});
    /// Takes a grid that is such a distance already: extract_surface() and start_from_...() give one.
    /// @throws Error InvalidInput (null, another class of grid, another background, voxels that are no cubes).
    COVOL_API explicit LevelSet(FloatGridPtr distance);

    [[nodiscard]] const FloatGrid& grid() const { return *grid_; }
    /// For functions that take a pointer, and for files; not to be written to.
    [[nodiscard]] const FloatGridPtr& pointer() const { return grid_; }
    [[nodiscard]] COVOL_API Domain domain() const;

    /// Distances from places to the surface, trilinear between voxels, negative inside; no more than the band's half
    /// width. @param places  world units
    [[nodiscard]] COVOL_API std::vector<double> sample(std::span<const Vec3> places) const;
    [[nodiscard]] COVOL_API double sample(const Vec3& place) const;

    /// The surface moved outward by `distance` world units, < 0 inward, along its normals, as far as the domain goes.
    /// @throws Error InvalidInput (nothing is left), InvalidOptions (not finite), Cancelled.
    [[nodiscard]] COVOL_API LevelSet offset(double distance, const RunContext& run = {}) const;
    /// What lies in one or the other, in both, or in this and not in the other, on this lattice and domain.
    /// @throws Error InvalidInput (nothing is left), Cancelled.
    [[nodiscard]] COVOL_API LevelSet united(const LevelSet& other, const RunContext& run = {}) const;
    [[nodiscard]] COVOL_API LevelSet intersected(const LevelSet& other, const RunContext& run = {}) const;
    [[nodiscard]] COVOL_API LevelSet without(const LevelSet& other, const RunContext& run = {}) const;

    /// Volume, area, pieces and handles of its triangles, which are not kept.
    [[nodiscard]] COVOL_API MeshMeasures measure(const RunContext& run = {}) const;

private:
    FloatGridPtr grid_;
};

}  // namespace covol
