#pragma once
#include <cstdint>
#include <string>

#include "covol/api.h"
#include "covol/mesh.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

struct RelaxOptions {
    double isovalue = 0.0;   ///< world units; that of extract_mesh()
    int rounds = 3;          ///< >= 0: rounds of edge flips and moves; 0 leaves the mesh unchanged
    double tolerance = 0.0;  ///< voxels; > 0: no change moves a triangle farther from the level set than this
};

template <>
inline constexpr auto kOptions<RelaxOptions> =
    std::tuple{Option{"isovalue", &RelaxOptions::isovalue}, Option{"rounds", &RelaxOptions::rounds, kNotNegative},
               Option{"tolerance", &RelaxOptions::tolerance, kNotNegative}};

struct RelaxReport {
    std::int64_t triangles = 0;  ///< afterwards
    double smallest_angle_before = 0,
           smallest_angle = 0;   ///< degrees: 1st percentile of the triangles' smallest angles
    std::int64_t flips = 0;      ///< edges flipped
    std::int64_t collapses = 0;  ///< short edges of slivers collapsed
    MeshDeviation deviation;     ///< from the level set, of the vertices too
};

/// Improves the shape of the triangles of a level set's mesh: edges are flipped if that increases the smallest angle,
/// vertices move towards the centre of their neighbours along the surface and back onto the level set (tangential
/// relaxation, as Botsch and Kobbelt, A remeshing approach to multiresolution modeling, 2004). No change is made that
/// would invert a triangle or make two touch: a closed manifold mesh without self-intersection stays one, of the same
/// topology. Vertices on a boundary do not move, those on the flat faces of a clip stay in their plane. Deterministic;
/// numbers of vertices and triangles do not change.
/// @param level_set  from which the mesh was extracted.
/// @throws Error InvalidOptions, InvalidInput (an edge with more than two triangles).
COVOL_API RelaxReport relax_mesh(TriangleMesh& mesh, const FloatGrid& level_set, const RelaxOptions& options = {},
                                 const RunContext& run = {});

/// The distances of a mesh's points, at most a voxel apart, from a level set, to first order, without the caps of a
/// clip.
[[nodiscard]] COVOL_API MeshDeviation measure_deviation(const FloatGrid& level_set, const TriangleMesh& mesh,
                                                        double isovalue = 0.0, const RunContext& run = {});

}  // namespace covol
