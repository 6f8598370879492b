#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristics.h"

namespace covol {

/// Pieces of a surface: pieces.cpp.
struct PiecesHeuristics {
    /// [volumes of the largest] Number of active voxels of a piece without marks, relative to the largest piece, up to
    /// which it is removed.
    double small = heuristic("pieces.small", 0.01);
};
COVOL_HEURISTICS PiecesHeuristics kPieces{};

}  // namespace covol
