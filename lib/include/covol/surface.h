#pragma once
#include <cstdint>
#include <vector>

#include "covol/api.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// The signed distance to the zero level set of u: class GRID_LEVEL_SET, half width 3 voxels, name "surface". A solid
/// that reaches the domain's boundary is closed there. @throws Error InvalidInput (no zero crossing).
[[nodiscard]] COVOL_API FloatGridPtr extract_surface(const FloatGrid& u, const RunContext& run = {});

/// Converts a level set to a fog volume with values in [0,1]: class GRID_FOG_VOLUME, name "density".
[[nodiscard]] COVOL_API FloatGridPtr to_fog_volume(const FloatGrid& surface);

struct ExtractOptions {
    double isovalue = 0.0;              ///< level at which the mesh is extracted, world units
    double min_component_volume = 0.0;  ///< world units^3; smaller components are dropped; 0 keeps all
};

template <>
inline constexpr auto kOptions<ExtractOptions> =
    std::tuple{Option{"isovalue", &ExtractOptions::isovalue, kAnyLength, single_step(Group::MeshFiles),
                      "extract the level set at this distance outside the surface", "0"},
               Option{"min_component", &ExtractOptions::min_component_volume, kVolume, Group::MeshFiles,
                      "drop pieces of the mesh that are smaller than a cube of this edge length"}};

/// The closed, manifold mesh of a level set at ExtractOptions::isovalue, oriented outward, in world units.
[[nodiscard]] COVOL_API TriangleMesh extract_mesh(const FloatGrid& surface, const ExtractOptions& options = {},
                                                  const RunContext& run = {});

/// Label image in the given geometry (i fastest): `label` in voxels whose centre is inside, else 0.
[[nodiscard]] COVOL_API std::vector<std::uint8_t> rasterize(const FloatGrid& surface, const ImageGeometry& geometry,
                                                            std::uint8_t label = 1, const RunContext& run = {});

/// Distances from points to the surface, world units.
struct FitStatistics {
    double mean = 0, p95 = 0, max = 0;
    /// only from segment(): mean of the signed distances; > 0 if the points lie outside on average, that is, if the
    /// surface is too small
    double bias = 0;
};
[[nodiscard]] COVOL_API FitStatistics measure_fit(const std::vector<Vec3>& points, const TriangleMesh& mesh,
                                                  const RunContext& run = {});

/// Distances from points to the zero level set, without a mesh. They are interpolated for points within the level set's
/// half width less one voxel; the others are at most 0.12 voxels too large. @throws Error InvalidInput (no point)
[[nodiscard]] COVOL_API FitStatistics measure_fit(const std::vector<Vec3>& points, const FloatGrid& surface,
                                                  const RunContext& run = {});

}  // namespace covol
