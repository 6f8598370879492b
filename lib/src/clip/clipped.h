#pragma once
// Solids cut off at the end of the image.
#include <array>
#include <limits>
#include <optional>

#include "covol/clip.h"
#include "covol/domain.h"
#include "covol/run.h"

namespace covol::detail {

/// The signed distance to the part of a solid that lies in the clip.
/// @param distance  to the whole solid, known on `domain`; class GRID_LEVEL_SET. Ownership is taken.
[[nodiscard]] FloatGridPtr clipped(FloatGridPtr distance, const Domain& domain, const Clip& clip);

/// The faces of an axis-aligned clip, as positions in index space; infinite on a side without a face.
struct LatticeClip {
    static constexpr double kFar = std::numeric_limits<double>::infinity();
    std::array<double, 3> low{-kFar, -kFar, -kFar}, high{kFar, kFar, kFar};

    /// The layer of voxels that represents a face: the first layer beyond the face or, if the last layer inside is less
    /// than 0.1 voxels away from the face, that last layer, because cells between it and the face would be almost flat.
    [[nodiscard]] int face_layer(int axis, bool upper) const;
    /// The position of a layer of voxels along the axis: the face for its face_layer() and all layers beyond, otherwise
    /// the index of the layer.
    [[nodiscard]] double position(int axis, int layer) const;
    [[nodiscard]] bool on_face(int axis, int layer) const {
        return position(axis, layer) == low[axis] || position(axis, layer) == high[axis];
    }
};

/// The signed distance to the wall of a clipped solid, which is the surface of the solid itself without the faces of
/// the clip. The distance is continued beyond the faces. Interpolating the clipped distance rounds the edges of the
/// cut; interpolating this distance and then clipping does not.
struct Uncut {
    FloatGridPtr distance;
    LatticeClip clip;  ///< only the faces that the solid meets
};

/// How the layers beyond a face are filled.
enum class FaceLayer {
    InPlace,  ///< kCarriedOn layers are filled, each with the distance at its own position
    /// One layer is filled, with the distance at the face; extract_mesh() moves this layer onto the face, and regards
    /// all layers beyond as outside.
    OnFace
};
inline constexpr int kCarriedOn = 4;  ///< number of layers filled beyond a face: half width of the band plus one

/// Undoes the clip of a level set. @return none if no face cuts the solid, or if the clip is not aligned with the
/// lattice.
[[nodiscard]] std::optional<Uncut> uncut(const FloatGrid& surface, FaceLayer layer);

/// Maximum of n·x - offset over the planes: inside the clip, minus the distance to its boundary; outside, at most the
/// distance to it.
[[nodiscard]] double depth_in(const Clip& clip, const Vec3& x);

}  // namespace covol::detail
