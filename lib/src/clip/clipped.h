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

    /// The layer that represents a face: the first one beyond it, or one up to 0.1 voxels inside, so that no cell is
    /// flat.
    [[nodiscard]] int face_layer(int axis, bool upper) const;
    /// The position of a layer: on the face for the face's layer and those beyond, otherwise the layer's index.
    [[nodiscard]] double position(int axis, int layer) const;
    [[nodiscard]] bool on_face(int axis, int layer) const {
        return position(axis, layer) == low[axis] || position(axis, layer) == high[axis];
    }
};

/// The distance of a clipped solid to its own surface, the wall, without the faces of the clip, and continued beyond
/// them. Interpolating the clipped distance rounds the edges of the cut; interpolating this one and then clipping does
/// not.
struct Uncut {
    FloatGridPtr distance;
    LatticeClip clip;  ///< only the faces that the solid meets
};

/// How the layers beyond a face are filled.
enum class FaceLayer {
    InPlace,  ///< kCarriedOn layers, each with the distance at its own position
    OnFace    ///< one layer with the distance at the face, onto which it is moved; all layers beyond are outside
};
inline constexpr int kCarriedOn = 4;  ///< layers: half width of the band plus one

/// Undoes the clip of a level set. @return none if nothing is cut, or the clip is not aligned with the lattice.
[[nodiscard]] std::optional<Uncut> uncut(const FloatGrid& surface, FaceLayer layer);

/// Maximum of n·x - offset over the planes: inside the clip, minus the distance to its boundary; outside, at most the
/// distance to it.
[[nodiscard]] double depth_in(const Clip& clip, const Vec3& x);

}  // namespace covol::detail
