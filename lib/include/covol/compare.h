#pragma once
#include <optional>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/run.h"

namespace covol {

/// Similarity of two solids. The distances are measured from positions on either surface to the other surface, in world
/// units; those of both directions are evaluated together, so that the result does not depend on the order of the
/// solids.
struct CompareReport {
    double dice = 0, jaccard = 0;
    double volume_a = 0, volume_b = 0;
    double hausdorff = 0;  ///< the maximum distance (Hausdorff distance)
    double hd95 = 0;       ///< the 95th percentile of the distances
    double assd = 0;       ///< the mean distance (average symmetric surface distance)
};

/// A solid in one of the forms that covol writes; exactly one of mask, mesh and level_set is given.
struct Solid {
    std::optional<Image> mask;
    int label = 0;  ///< the label of the mask that is the solid; 0: all labels other than 0
    std::optional<TriangleMesh> mesh;
    FloatGridPtr level_set;
};
/// Reads an image, a mesh or a .vdb file, by the file extension; the grid of a .vdb is chosen as by
/// read_vdb_level_set().
[[nodiscard]] COVOL_API Solid read_solid(const std::string& path, int label = 0, const RunContext& run = {});

/// Measures the overlap of two solids and the distances between their surfaces. The overlap is counted on the finer
/// lattice of two masks or two level sets, on the mask's lattice if only one solid is a mask, on the level set's
/// lattice for a level set and a mesh, and on a lattice of 256 voxels along the longest side for two meshes.
[[nodiscard]] COVOL_API CompareReport compare(const Solid& a, const Solid& b, const RunContext& run = {});

}  // namespace covol
