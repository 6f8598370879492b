#pragma once
// The surface of minimum area between given vertices.
#include <vector>

#include "covol/mesh.h"
#include "covol/run.h"

namespace covol::holes {

/// Moves the free vertices such that the area becomes minimal: repeatedly solves for all positions at once such that
/// each is the mean of its neighbours, weighted by the cotangents of the angles opposite to the edges (Pinkall and
/// Polthier 1993).
/// @pre each connected part of free vertices has a fixed neighbour
void span_membrane(TriangleMesh& mesh, const std::vector<char>& fixed, const RunContext& run);

}  // namespace covol::holes
