#pragma once
// The heuristic constants of this folder; docs/heuristics.md shows the effect of halving and doubling each.
#include "base/heuristic.h"

namespace covol {

/// Pieces of a surface: pieces.cpp.
struct PiecesHeuristics {
    /// [volumes of the largest] Size below which a piece without marks is removed.
    double small = heuristic("pieces.small", 0.01);
    /// [voxels] Margin around a piece's box within which a mark preserves it.
    int mark_voxels = heuristic("pieces.mark_voxels", 2);
};
COVOL_HEURISTICS PiecesHeuristics kPieces{};

}  // namespace covol
