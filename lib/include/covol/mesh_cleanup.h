#pragma once
#include <cstdint>
#include <optional>

#include "covol/api.h"
#include "covol/mesh.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

struct CleanupOptions {
    double target_edge = 0.0;  ///< > 0: decimate to about this edge length (world units)
    /// > 0: decimate as long as no triangle is farther from the level set than this (world units, at most two voxels):
    /// flat parts get large triangles; combined with target_edge, this limits it. Needs the level set.
    double adaptive = 0.0;
    int smooth_iterations = 0;  ///< tangential + normal (Taubin-like, volume preserving) smoothing steps
    bool repair = true;         ///< resolve self-intersections and non-manifold spots, fill holes
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
/// The effect of a step on a mesh.
struct CleanupStep {
    std::int64_t triangles = 0;
    double smallest_angle = 0;  ///< degrees: 1st percentile of the triangles' smallest angles
    MeshDeviation change;       ///< world units: from the mesh before, both ways, of vertices and centroids
    MeshDeviation deviation;    ///< voxels: from the level set; 0 if there is none
};
struct CleanupReport {
    int self_intersections = 0;  ///< pairs found before repair
    int holes_filled = 0;
    bool closed = false, manifold = false, intersection_free = false;  ///< afterwards
    std::optional<CleanupStep> decimation, smoothing;
};
/// Makes a mesh closed, manifold, outward and free of self-intersections, in place (CGAL, OpenMesh). Decimation and
/// smoothing do not move vertices whose move would make triangles touch.
/// @throws Error InvalidOptions, InvalidInput (a mesh that is not manifold, to be decimated without repair).
COVOL_API CleanupReport clean_mesh(TriangleMesh& mesh, const CleanupOptions& options = {}, const RunContext& run = {});

/// The same for a mesh of a level set: decimated triangles are relaxed on it (relax_mesh()).
COVOL_API CleanupReport clean_mesh(TriangleMesh& mesh, const FloatGrid& level_set, double isovalue = 0.0,
                                   const CleanupOptions& options = {}, const RunContext& run = {});

/// Number of pairs of triangles that have a point in common other than the vertices and the edge that they share.
[[nodiscard]] COVOL_API int count_self_intersections(const TriangleMesh& mesh);

/// The same pairs, by whether both triangles belong to one component.
struct Crossings {
    int within = 0;   ///< a component and itself
    int between = 0;  ///< two components that touch or overlap, as structures with a common border do
};
[[nodiscard]] COVOL_API Crossings count_crossings(const TriangleMesh& mesh);

/// The wall thickness of the solid, world units: distances from the centres of triangles that are evenly spread over
/// the list, straight inward to the next triangle; the 1st percentile of up to 512. < 0: no ray hit a triangle.
[[nodiscard]] COVOL_API double measure_wall(const TriangleMesh& mesh, const RunContext& run = {});

}  // namespace covol
