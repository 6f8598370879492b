#pragma once
#include <cstdint>
#include <vector>

#include "grid/leaf_columns.h"

namespace covol::detail {

/// The tube of a distance grid as flat arrays, for tagging at any number of D.
struct Tube {
    /// @pre the grid has at least one leaf.
    explicit Tube(const FloatGrid& distance);

    /// Voxels of the tube with d <= limit.
    [[nodiscard]] std::vector<LeafMask> near(float limit) const;

    const Domain domain;
    const CoordBBox box;
    const LeafBand band;
    const LeafColumns columns;
    LeafArray<float> d;  ///< world units
    std::vector<LeafMask> inside_domain;
};

/// The exterior at one D, and the enclosed region.
struct Tagging {
    float distance = 0;          ///< D
    std::vector<LeafMask> open;  ///< d > D, in the domain
    Flood exterior;
    std::int64_t enclosed = 0;  ///< voxels that the flood did not reach
    std::int64_t core = 0;      ///< enclosed voxels with d > D

    /// Whether the core, treated as one ball, is a structure and not a pocket in a wall of thickness D.
    [[nodiscard]] bool has_core(double voxel_size) const;
};

/// Floods {d > D} from the domain's boundary and the seeds.
[[nodiscard]] Tagging tag(const Tube& tube, float tag_distance, const std::vector<Coord>& seeds);

/// Whether a core that is a structure, and not a pocket, is enclosed in `larger` but exterior in `smaller`.
[[nodiscard]] bool closes_a_core(const Tube& tube, const Tagging& smaller, const Tagging& larger);

/// |d - D| in voxels, with a negative sign at voxels that the flood did not reach. Its zero locates the tagged
/// surface.
[[nodiscard]] LeafArray<float> signed_level(const Tube& tube, const Tagging& tagging);

}  // namespace covol::detail
