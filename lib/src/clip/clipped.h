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

/// Positions at which an axis-aligned clip cuts the lattice, index space; infinite if it does not cut the solid.
struct LatticeClip {
    static constexpr double kFar = std::numeric_limits<double>::infinity();
    std::array<double, 3> low{-kFar, -kFar, -kFar}, high{kFar, kFar, kFar};

    /// The layer that represents the face: the first beyond it, or one just within, so that no cell is flat.
    [[nodiscard]] int face_layer(int axis, bool upper) const;
    /// Layers from the face's layer on lie on the face, all others at their index.
    [[nodiscard]] double position(int axis, int layer) const;
    [[nodiscard]] bool on_face(int axis, int layer) const {
        return position(axis, layer) == low[axis] || position(axis, layer) == high[axis];
    }
};

/// A clipped solid's distance with the cut undone near its faces and continued beyond, as the distance to the wall.
/// Interpolation of the clipped distance rounds the edges of the cut; that of this one, clipped afterwards, does not.
struct Uncut {
    FloatGridPtr distance;
    LatticeClip clip;
};

/// The layers beyond a face.
enum class FaceLayer {
    InPlace,  ///< kCarriedOn layers with the distance at their positions
    OnFace    ///< one layer with the distance on the face, onto which it is moved; all beyond is outside
};
inline constexpr int kCarriedOn = 4;  ///< half width of the band, and one more

/// @return none if nothing is cut, or the clip is not aligned with the lattice.
[[nodiscard]] std::optional<Uncut> uncut(const FloatGrid& surface, FaceLayer layer);

/// Largest n·x - offset over the planes: the negative distance to the clip's boundary inside, at most the distance
/// outside.
[[nodiscard]] double depth_in(const Clip& clip, const Vec3& x);

}  // namespace covol::detail
