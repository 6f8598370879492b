#pragma once
#include <optional>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/run.h"

namespace covol {

/// Similarity of two solids. Distances between their surfaces are symmetric (both directions pooled), in world units.
struct CompareReport {
    double dice = 0, jaccard = 0;
    double volume_a = 0, volume_b = 0;
    double hausdorff = 0;  ///< the maximum distance
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

/// Measures the overlap on the finer of the two lattices (if only one is a mask, on its voxels), and the distances
/// between the surfaces.
[[nodiscard]] COVOL_API CompareReport compare(const Solid& a, const Solid& b, const RunContext& run = {});

}  // namespace covol
