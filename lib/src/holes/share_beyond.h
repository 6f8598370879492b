#pragma once
#include <vector>

#include "covol/fwd.h"
#include "covol/mesh_stream.h"
#include "covol/run.h"

namespace covol::detail {

/// The plain surface of a level set, measured, and which share of its area lies farther than `distance` from every
/// point: measure_fraction_beyond() of a mesh that is never held.
struct BeyondPoints {
    StreamedMesh mesh;
    double fraction = 0;
};
[[nodiscard]] BeyondPoints measure_beyond(const FloatGrid& surface, const std::vector<Vec3>& points, double distance,
                                          const RunContext& run);

}  // namespace covol::detail
