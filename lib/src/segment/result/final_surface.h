#pragma once
// The surface of a solution: its distance, its mesh, and the treatment of its holes.
#include <vector>

#include "segment/solve/flow.h"

namespace covol::pipeline {

struct Surface {
    FloatGridPtr u;                         ///< the level set from which the surface is made; null without fields
    FloatGridPtr level_set;                 ///< the signed distance to the surface
    TriangleMesh mesh;                      ///< empty without a mesh
    std::vector<float> distance_to_points;  ///< at the mesh's vertices; only for points without an image
    std::vector<Vec3> marks;                ///< Choices::measured_marks without those that are likely wrong
    std::vector<double> mark_distances;     ///< from `marks` to the surface; empty if no points attract
    std::int64_t active_voxels = 0, leaf_count = 0;
    MeshMeasures measures;
    RelaxReport mesh_report;
    HolesReport holes;
    double fraction_without_points = 0;
    StepReport report;
};

/// @param solution  its u, distance and edges are released if the options request no fields
/// @param known     the surface of u if it is computed already, or null
[[nodiscard]] Surface make_surface(const Problem& problem, const Choices& choices, Solution& solution,
                                   const FloatGridPtr& known = nullptr);

}  // namespace covol::pipeline
