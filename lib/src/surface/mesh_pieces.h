#pragma once
#include <functional>

#include "covol/fwd.h"
#include "covol/mesh_stream.h"
#include "covol/run.h"

namespace covol::detail {

struct MeshPiece;

/// measure_surface(), and on the way every piece of the mesh; of `mesh` all but the measures are known by then.
StreamedMesh measure_pieces(const FloatGrid& surface, double isovalue, const RunContext& run,
                            const std::function<void(const StreamedMesh& mesh, const MeshPiece& piece)>& take);

}  // namespace covol::detail
