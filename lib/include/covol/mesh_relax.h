#pragma once
#include <cstdint>
#include <string>

#include "covol/api.h"
#include "covol/mesh.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

struct RelaxOptions {
    double isovalue = 0.0;   ///< world units; the same value as for extract_mesh()
    int rounds = 3;          ///< >= 0: number of rounds of edge flips and vertex moves; 0 leaves the mesh unchanged
    double tolerance = 0.0;  ///< voxels; > 0: no change moves a triangle farther from the level set than this
};

template <>
inline constexpr auto kOptions<RelaxOptions> =
    std::tuple{Option{"isovalue", &RelaxOptions::isovalue}, Option{"rounds", &RelaxOptions::rounds, kNotNegative},
               Option{"tolerance", &RelaxOptions::tolerance, kNotNegative}};

struct RelaxReport {
    std::int64_t triangles = 0;  ///< number after relaxation
    /// degrees: 1st percentile of the triangles' smallest angles
    double smallest_angle_before = 0, smallest_angle = 0;
    std::int64_t flips = 0;      ///< number of flipped edges
    std::int64_t collapses = 0;  ///< number of short edges of slivers that were collapsed
    /// distance of the vertices and triangles from the level set, as from measure_deviation()
    MeshDeviation deviation;
};

/// Improves the shape of the triangles of a level set's mesh: edges are flipped if that increases the smallest angle,
/// vertices move towards the centre of their neighbours along the surface and back onto the level set (tangential
/// relaxation, as Botsch and Kobbelt, A remeshing approach to multiresolution modeling, 2004). Short edges of slivers
/// are collapsed, which removes triangles. No change is made that would invert a triangle or cause two triangles to
/// touch: a closed manifold mesh without self-intersection keeps these properties and its topology. Vertices on a
/// boundary do not move, and those on the flat faces of a clip stay in their plane. The result is deterministic.
/// @param level_set  from which the mesh was extracted.
/// @throws Error InvalidOptions, InvalidInput (an edge with more than two triangles).
COVOL_API RelaxReport relax_mesh(TriangleMesh& mesh, const FloatGrid& level_set, const RelaxOptions& options = {},
                                 const RunContext& run = {});

/// The distances from a level set, to first order, of points of a mesh that are at most a voxel apart; points on the
/// caps of a clip are omitted.
[[nodiscard]] COVOL_API MeshDeviation measure_deviation(const FloatGrid& level_set, const TriangleMesh& mesh,
                                                        double isovalue = 0.0, const RunContext& run = {});

}  // namespace covol
