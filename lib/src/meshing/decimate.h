#pragma once
#include <cstddef>

#include "covol/mesh.h"
#include "covol/run.h"
#include "meshing/level.h"

namespace covol::meshing {

struct DecimateGoal {
    std::size_t triangles = 0;  ///< as many are to be left
    double tolerance = 0;       ///< voxels; > 0: no triangle that is changed leaves the surface farther than that
};

/// Collapses edges into one of their ends by OpenMesh, those first that move the surface least (quadric error metric,
/// Garland and Heckbert 1997), until the goal is reached or no edge can be drawn together without turning a triangle,
/// making a needle of it, letting it touch another, or changing the topology. Of edges that cost the same, the shorter
/// go first. The vertices left stay where they are.
/// @param surface  what the mesh stands for: vertices stay on the faces of its clip; null where it is not known.
/// @pre  triangles do not touch; surface is given where there is a tolerance.
/// @throws Error InvalidInput (an edge with more than two triangles).
void decimate(TriangleMesh& mesh, const Surface* surface, const DecimateGoal& goal, const RunContext& run);

}  // namespace covol::meshing
