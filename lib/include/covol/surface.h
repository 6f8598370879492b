#pragma once
#include <cstdint>
#include <vector>

#include "covol/api.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// The zero level set of u as a true signed distance: class GRID_LEVEL_SET, half width 3 voxels, name "surface".
/// Where the solid reaches the domain's boundary it is closed there. @throws Error InvalidInput (no zero crossing).
[[nodiscard]] COVOL_API FloatGridPtr extract_surface(const FloatGrid& u, const RunContext& run = {});

/// Fog volume in [0,1] of a level set: class GRID_FOG_VOLUME, name "density".
[[nodiscard]] COVOL_API FloatGridPtr to_fog_volume(const FloatGrid& surface);

struct ExtractOptions {
    double isovalue = 0.0;              ///< world units
    double min_component_volume = 0.0;  ///< world units^3; smaller components are dropped; 0 keeps all
};

template <>
inline constexpr auto kOptions<ExtractOptions> =
    std::tuple{Option{"isovalue", &ExtractOptions::isovalue, kAnyLength, single_step(Group::MeshFiles),
                      "extract the level set at this distance outside the surface", "0"},
               Option{"min_component", &ExtractOptions::min_component_volume, kVolume, Group::MeshFiles,
                      "drop pieces of the mesh that are smaller than a cube of this edge length"}};

/// Closed, manifold, outward triangles of the zero level set, in world units.
[[nodiscard]] COVOL_API TriangleMesh extract_mesh(const FloatGrid& surface, const ExtractOptions& options = {},
                                                  const RunContext& run = {});

/// Label image in the given geometry (i fastest): `label` where the voxel's centre is inside, else 0.
[[nodiscard]] COVOL_API std::vector<std::uint8_t> rasterize(const FloatGrid& surface, const ImageGeometry& geometry,
                                                            std::uint8_t label = 1, const RunContext& run = {});

/// Distances from points to the zero level set (world units), exact to the extracted triangles.
struct FitStatistics {
    double mean = 0, p95 = 0, max = 0;
    /// only from segment(): mean of the signed distances; > 0 if the points lie outside, so that the surface is too
    /// small
    double bias = 0;
};
[[nodiscard]] COVOL_API FitStatistics measure_fit(const std::vector<Vec3>& points, const TriangleMesh& mesh,
                                                  const RunContext& run = {});

/// The same without the mesh: distances are interpolated within the level set's half width, and at most 0.12 voxels too
/// large beyond it. @throws Error InvalidInput (no point)
[[nodiscard]] COVOL_API FitStatistics measure_fit(const std::vector<Vec3>& points, const FloatGrid& surface,
                                                  const RunContext& run = {});

}  // namespace covol
