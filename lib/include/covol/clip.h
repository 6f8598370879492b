#pragma once
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/image.h"

namespace covol {

/// A half-space: n·x <= offset; n is a unit vector, lengths are world units.
struct HalfSpace {
    Vec3 normal{1, 0, 0};
    double offset = 0;
    friend bool operator==(const HalfSpace&, const HalfSpace&) = default;
};

/// The convex body at which a solid is clipped: the intersection of the half-spaces; empty if nothing is clipped. A
/// domain consists of whole voxels and may extend up to half a voxel beyond the image; the clip is the image's exact
/// end.
using Clip = std::vector<HalfSpace>;

[[nodiscard]] COVOL_API Clip make_clip(const WorldBox& box);
/// The image's own box, half a voxel beyond the outermost voxel centres; rotated as the image is.
[[nodiscard]] COVOL_API Clip make_clip(const ImageGeometry& geometry);

/// Stores the clip as metadata ("covol_clip_0", ...). extract_surface() closes the solid there with a flat cap;
/// extract_mesh() places caps that are parallel to the lattice exactly on it, with sharp edges; rasterize() ends there.
COVOL_API void set_clip(FloatGrid& grid, const Clip& clip);
/// The clip that set_clip() stored, or an empty one.
[[nodiscard]] COVOL_API Clip clip_of(const FloatGrid& grid);

}  // namespace covol
