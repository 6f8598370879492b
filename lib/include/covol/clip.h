#pragma once
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/image.h"

namespace covol {

/// The half-space of the positions x with n·x <= offset; n is `normal`, a unit vector, and lengths are world units.
struct HalfSpace {
    Vec3 normal{1, 0, 0};
    double offset = 0;
    friend bool operator==(const HalfSpace&, const HalfSpace&) = default;
};

/// The convex body to which a solid is clipped: the intersection of the half-spaces; an empty list clips nothing. Clips
/// are needed because a domain consists of whole voxels and may therefore extend beyond the image.
using Clip = std::vector<HalfSpace>;

[[nodiscard]] COVOL_API Clip make_clip(const WorldBox& box);
/// The box that consists of all voxels of the image (whole voxels, not only their centres); rotated like the image.
[[nodiscard]] COVOL_API Clip make_clip(const ImageGeometry& geometry);

/// Stores the clip as metadata ("covol_clip_0", ...). extract_surface() closes the solid at the clip's faces with flat
/// caps; extract_mesh() places caps that are parallel to the lattice exactly on the faces, with sharp edges;
/// rasterize() sets voxels beyond them to 0.
COVOL_API void set_clip(FloatGrid& grid, const Clip& clip);
/// The clip that set_clip() stored, or an empty one.
[[nodiscard]] COVOL_API Clip clip_of(const FloatGrid& grid);

}  // namespace covol
