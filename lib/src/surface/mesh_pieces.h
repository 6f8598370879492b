#pragma once
#include <functional>

#include "covol/fwd.h"
#include "covol/mesh_stream.h"
#include "covol/run.h"

namespace covol::detail {

struct MeshPiece;

/// measure_surface() that also passes every piece of the mesh to `take`; all fields of `mesh` except the measures are
/// set by then.
StreamedMesh measure_pieces(const FloatGrid& surface, double isovalue, const RunContext& run,
                            const std::function<void(const StreamedMesh& mesh, const MeshPiece& piece)>& take);

}  // namespace covol::detail
