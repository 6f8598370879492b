#pragma once
#include <functional>

#include "covol/fwd.h"
#include "covol/mesh_stream.h"
#include "covol/run.h"

namespace covol::detail {

struct MeshPiece;

/// Like measure_surface(), but also passes every piece of the mesh to `take`, with a `mesh` of which all fields except
/// the measures are set.
StreamedMesh measure_pieces(const FloatGrid& surface, double isovalue, const RunContext& run,
                            const std::function<void(const StreamedMesh& mesh, const MeshPiece& piece)>& take);

}  // namespace covol::detail
