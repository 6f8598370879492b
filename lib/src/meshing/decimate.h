#pragma once
#include <cstddef>

#include "covol/mesh.h"
#include "covol/run.h"
#include "meshing/level.h"

namespace covol::meshing {

struct DecimateGoal {
    std::size_t triangles = 0;  ///< decimation ends when at most this number is left
    double tolerance = 0;       ///< voxels: maximum distance of changed triangles from the surface; 0: no limit
};

/// Collapses edges into one of their ends by OpenMesh, in the order of increasing displacement of the surface (quadric
/// error metric, Garland and Heckbert 1997), until the goal is reached or no edge can be collapsed without turning a
/// triangle, making it a needle, letting it touch another, or changing the topology. Of edges with equal cost, shorter
/// ones are first. The remaining vertices do not move.
/// @param surface  represented by the mesh: vertices stay on the faces of its clip. Null if it is unknown.
/// @pre  triangles do not touch; surface is given if there is a tolerance.
/// @throws Error InvalidInput (an edge with more than two triangles).
void decimate(TriangleMesh& mesh, const Surface* surface, const DecimateGoal& goal, const RunContext& run);

}  // namespace covol::meshing
