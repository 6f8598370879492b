#pragma once
// The heuristic constants of this folder: docs/heuristics.md shows what half and twice of each does.
#include "base/heuristic.h"

namespace covol {

/// Pieces of a surface: pieces.cpp.
struct PiecesHeuristics {
    /// [volumes of the largest] A piece that is less goes where no mark holds it.
    double small = heuristic("pieces.small", 0.01);
    /// [voxels] Around a piece's box, within which marks hold it.
    int mark_voxels = heuristic("pieces.mark_voxels", 2);
};
COVOL_HEURISTICS PiecesHeuristics kPieces{};

}  // namespace covol
