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
    /// > 0: decimate as far as no triangle comes farther from the level set than this (world units, at most two
    /// voxels): flat parts get large triangles; with target_edge, no farther than that. Needs the level set.
    double adaptive = 0.0;
    int smooth_iterations = 0;  ///< tangential + normal (Taubin-like, volume keeping) smoothing steps
    bool repair = true;         ///< resolve self-intersections and non-manifold spots, fill holes
};

template <>
inline constexpr auto kOptions<CleanupOptions> =
    std::tuple{Option{"target_edge", &CleanupOptions::target_edge, kLength, Group::MeshFiles,
                      "decimate to about this edge length"},
               Option{"adaptive", &CleanupOptions::adaptive, kLength, Group::MeshFiles,
                      "decimate as far as no triangle comes farther from the level set: large triangles where it is "
                      "flat; at most 2vx"},
               Option{"smooth", &CleanupOptions::smooth_iterations, kNotNegative, Group::MeshFiles,
                      "steps of volume-keeping smoothing"},
               Option{"repair", &CleanupOptions::repair, Group::MeshFiles, "resolve self-intersections, fill holes"}};
/// What a step has made of a mesh.
struct CleanupStep {
    std::int64_t triangles = 0;
    double smallest_angle = 0;  ///< degrees: 1st percentile of the triangles' smallest angles
    MeshDeviation
        change;  ///< world units: from the mesh before, both ways, of the vertices and the middles of triangles
    MeshDeviation deviation;  ///< voxels: from the level set, 0 where there is none
};
struct CleanupReport {
    int self_intersections = 0;  ///< pairs found before repair
    int holes_filled = 0;
    bool closed = false, manifold = false, intersection_free = false;  ///< afterwards
    std::optional<CleanupStep> decimation, smoothing;
};
/// Makes a mesh closed, manifold, outward and free of self-intersections, in place (CGAL, OpenMesh). Decimation and
/// smoothing leave vertices where they are whose move would let triangles touch.
/// @throws Error InvalidOptions, InvalidInput (a mesh that is not manifold, and is to be decimated without repair).
COVOL_API CleanupReport clean_mesh(TriangleMesh& mesh, const CleanupOptions& options = {}, const RunContext& run = {});

/// The same for a mesh of a level set: decimated triangles are relaxed on it (relax_mesh()).
COVOL_API CleanupReport clean_mesh(TriangleMesh& mesh, const FloatGrid& level_set, double isovalue = 0.0,
                                   const CleanupOptions& options = {}, const RunContext& run = {});

/// Pairs of triangles that have a point in common beyond the vertices and the edge that they share.
[[nodiscard]] COVOL_API int count_self_intersections(const TriangleMesh& mesh);

/// The same pairs, by whether both triangles belong to one piece.
struct Crossings {
    int within = 0;   ///< a piece and itself
    int between = 0;  ///< two pieces that touch or overlap, as structures that share a border do
};
[[nodiscard]] COVOL_API Crossings count_crossings(const TriangleMesh& mesh);

/// How thin the solid is, world units: from the middles of triangles that are evenly spread over the list, straight
/// inward to the next triangle; the 1st percentile of up to 512. < 0: no ray met one.
[[nodiscard]] COVOL_API double measure_wall(const TriangleMesh& mesh, const RunContext& run = {});

}  // namespace covol
