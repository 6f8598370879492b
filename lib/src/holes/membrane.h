#pragma once
// The surface of least area between given vertices.
#include <vector>

#include "covol/mesh.h"
#include "covol/run.h"

namespace covol::holes {

/// Moves the vertices that are not fixed so that the area gets least: each becomes the mean of its neighbours, weighted
/// by the cotangents of the angles opposite to the edges, solved for all at once, again and again (Pinkall and Polthier
/// 1993).
/// @pre each connected part of free vertices has a fixed neighbour
void span_membrane(TriangleMesh& mesh, const std::vector<char>& fixed, const RunContext& run);

}  // namespace covol::holes
