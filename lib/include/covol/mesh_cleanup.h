#pragma once
#include <cstdint>
#include <optional>

#include "covol/api.h"
#include "covol/mesh.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

struct CleanupOptions {
    double target_edge = 0.0;  ///< > 0: the mesh is decimated to about this edge length, world units
    /// > 0: the mesh is decimated as far as possible with no triangle farther from the level set than this (world
    /// units, at most two voxels), with large triangles in flat parts; with target_edge, it limits that decimation.
    /// Requires the level set.
    double adaptive = 0.0;
    /// number of smoothing steps, tangential and normal (similar to Taubin's, volume preserving)
    int smooth_iterations = 0;
    bool repair = true;  ///< resolves self-intersections and non-manifold parts, and fills holes
};

template <>
inline constexpr auto kOptions<CleanupOptions> = std::tuple{
    Option{"target_edge", &CleanupOptions::target_edge, kLength, Group::MeshFiles,
           "decimate to about this edge length"},
    Option{"adaptive", &CleanupOptions::adaptive, kLength, Group::MeshFiles,
           "decimate as far as possible with all triangles within this distance of the level set, with large triangles "
           "in flat regions; at most 2vx"},
    Option{"smooth", &CleanupOptions::smooth_iterations, kNotNegative, Group::MeshFiles,
           "steps of volume-preserving smoothing"},
    Option{"repair", &CleanupOptions::repair, Group::MeshFiles, "resolve self-intersections and fill holes"}};
/// The effect of a cleanup step on a mesh.
struct CleanupStep {
    std::int64_t triangles = 0;  ///< number after the step
    double smallest_angle = 0;   ///< degrees: 1st percentile of the triangles' smallest angles
    MeshDeviation change;  ///< world units: distances between the meshes before and after the step, in both directions,
                           ///< at vertices and centroids
    MeshDeviation deviation;  ///< voxels: distance from the level set; 0 if there is none
};
struct CleanupReport {
    int self_intersections = 0;  ///< number of pairs of triangles before the repair
    int holes_filled = 0;        ///< including holes that the removal of self-intersections left
    bool closed = false, manifold = false, intersection_free = false;  ///< of the mesh after all steps
    std::optional<CleanupStep> decimation, smoothing;
};
/// Modifies a mesh so that it is closed, manifold, oriented outward and free of self-intersections (CGAL, OpenMesh).
/// Decimation and smoothing make no change that would cause triangles to touch.
/// @throws Error InvalidOptions, InvalidInput (decimation without repair of a mesh that is not manifold).
COVOL_API CleanupReport clean_mesh(TriangleMesh& mesh, const CleanupOptions& options = {}, const RunContext& run = {});

/// Modifies the mesh of a level set as the overload without a level set does; after decimation, relax_mesh() also
/// improves the triangles on that level set.
COVOL_API CleanupReport clean_mesh(TriangleMesh& mesh, const FloatGrid& level_set, double isovalue = 0.0,
                                   const CleanupOptions& options = {}, const RunContext& run = {});

/// Number of pairs of triangles that have a point in common other than the vertices and the edge that they share.
[[nodiscard]] COVOL_API int count_self_intersections(const TriangleMesh& mesh);

/// Numbers of intersecting pairs of triangles, as count_self_intersections() counts them, by whether both triangles
/// belong to the same component.
struct Crossings {
    int within = 0;   ///< pairs within one component
    int between = 0;  ///< pairs of two components, which touch or overlap, like structures with a common border
};
[[nodiscard]] COVOL_API Crossings count_crossings(const TriangleMesh& mesh);

/// The wall thickness of the solid, world units: the 1st percentile of the distances from the centres of up to 512
/// triangles, evenly spaced in the mesh's list, straight inward to the next triangle. < 0: no ray hit a triangle.
[[nodiscard]] COVOL_API double measure_wall(const TriangleMesh& mesh, const RunContext& run = {});

}  // namespace covol
