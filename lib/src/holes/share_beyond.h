#pragma once
#include <vector>

#include "covol/fwd.h"
#include "covol/mesh_stream.h"
#include "covol/run.h"

namespace covol::detail {

/// The measures of the mesh extracted from a level set, and the fraction of its area that is farther than `distance`
/// from all points: like measure_fraction_beyond(), but without holding the mesh in memory.
struct BeyondPoints {
    StreamedMesh mesh;
    double fraction = 0;
};
[[nodiscard]] BeyondPoints measure_beyond(const FloatGrid& surface, const std::vector<Vec3>& points, double distance,
                                          const RunContext& run);

}  // namespace covol::detail
