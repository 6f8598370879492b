#pragma once
#include "covol/domain.h"
#include "covol/run.h"
#include "redistance/interface_patches.h"

namespace covol::detail {

/// The signed distance to u's zero level set, in a band of `half_width` voxels; class GRID_LEVEL_SET. The zero level
/// set stays that of linear interpolation of u along voxel edges, however steep u is.
/// @throws Error InvalidInput (no zero crossing in the domain; a background that is not positive).
[[nodiscard]] FloatGridPtr redistance(const FloatGrid& u, const Domain& domain, double half_width, DomainEnd end,
                                      const char* name, const RunContext& run);

}  // namespace covol::detail
