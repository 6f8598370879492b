#pragma once
#include <optional>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"

namespace covol {

/// An axis-aligned box in world space.
struct WorldBox {
    Vec3 min{0, 0, 0};
    Vec3 max{0, 0, 0};
};
[[nodiscard]] COVOL_API double longest_side(const WorldBox& box);

/// Half the width of narrow bands, and the clamp on initial values, in voxels: initial values are in [-3h, 3h].
inline constexpr double kHalfWidthVoxels = 3.0;

/// The computational domain: a box of isotropic voxels, aligned with the world's axes.
///
/// Voxel (i,j,k) is a cube of edge h whose centre lies at origin + h * (i,j,k). The domain contains the voxels from
/// `min` to `max`, inclusive; their outer faces are its boundary. set_domain() stores h and origin as the transform of
/// a grid, and `min` and `max` as its metadata.
struct Domain {
    double voxel_size = 1.0;  ///< h > 0, world units
    Vec3 origin{0, 0, 0};     ///< world position of the centre of voxel (0,0,0)
    Index3 min{0, 0, 0};      ///< first voxel
    Index3 max{-1, -1, -1};   ///< last voxel, inclusive

    [[nodiscard]] COVOL_API Vec3 index_to_world(const Vec3& index) const;
    [[nodiscard]] COVOL_API Vec3 world_to_index(const Vec3& world) const;
    /// The box between the domain's outer faces.
    [[nodiscard]] COVOL_API WorldBox world_box() const;
    [[nodiscard]] COVOL_API bool contains(const Vec3& world) const;
    [[nodiscard]] COVOL_API std::int64_t voxel_count() const;
    friend bool operator==(const Domain&, const Domain&) = default;
};

/// The smallest box of voxels of edge h that covers `box`, centred on it. If the edges of `box` are multiples of h,
/// both boxes are equal; the domain of an isotropic image therefore has the image's voxels.
/// @throws Error InvalidOptions (h <= 0, not finite), InvalidInput (an empty box, or more than 2^30 voxels along an
/// axis).
[[nodiscard]] COVOL_API Domain make_domain(const WorldBox& box, double voxel_size);

/// The voxels that cover `box`, up to rounding, on the lattice given by voxel size and origin of `lattice`, whose
/// extent is ignored. All such domains have the same transform, so that their grids can be joined voxel by voxel.
/// @throws Error InvalidInput (an empty box, or one that reaches more than 2^23 voxels from voxel (0,0,0)).
[[nodiscard]] COVOL_API Domain covering(const Domain& lattice, const WorldBox& box);

/// The voxels of edge h that cover `box`. Their lattice does not depend on `box`, so the grids of two parts of an image
/// or of a cloud can be joined.
/// @param image   world box of the image: if h is its spacing, the voxels of the lattice are those of the image.
///     Without an image, the lattice begins at the world's origin or, for a box more than 2^22 voxels from it, at a
///     multiple of 2^22 voxels
/// @param origin  centre of voxel (0,0,0); if it is given, it takes precedence over the rules for `image`
/// @throws Error InvalidOptions, InvalidInput as make_domain and covering.
[[nodiscard]] COVOL_API Domain choose_domain(const WorldBox& box, double voxel_size,
                                             const std::optional<WorldBox>& image, const std::optional<Vec3>& origin);

/// The domain with `layers` more voxels on every side, on the same lattice.
[[nodiscard]] COVOL_API Domain widened(Domain domain, int layers);

/// The smallest box around the points, enlarged by `margin` (world units) on every side.
[[nodiscard]] COVOL_API WorldBox bounding_box(const std::vector<Vec3>& points, double margin = 0.0);

/// Sets the grid's transform and stores the box as metadata ("covol_domain_min", "covol_domain_max").
COVOL_API void set_domain(FloatGrid& grid, const Domain& domain);

/// The domain that set_domain() stored. If the metadata are missing, the box is the bounding box of the active voxels,
/// enlarged by 8 voxels on every side, so that the surface does not touch its boundary.
/// @throws Error InvalidInput if the transform is not a uniform scale and a translation.
[[nodiscard]] COVOL_API Domain domain_of(const FloatGrid& grid);

/// An empty grid on `domain`: `background` everywhere, no active voxel, the given name.
[[nodiscard]] COVOL_API FloatGridPtr make_grid(const Domain& domain, float background, const char* name);

}  // namespace covol
