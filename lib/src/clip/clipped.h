#pragma once
// Solids cut off where the image ends.
#include <array>
#include <limits>
#include <optional>

#include "covol/clip.h"
#include "covol/domain.h"
#include "covol/run.h"

namespace covol::detail {

/// The signed distance to the part of a solid that lies in the clip.
/// @param distance  to the whole solid, known on `domain`; class GRID_LEVEL_SET. Taken over.
[[nodiscard]] FloatGridPtr clipped(FloatGridPtr distance, const Domain& domain, const Clip& clip);

/// Where an axis-aligned clip cuts the lattice, index space; infinite where it does not cut the solid.
struct LatticeClip {
    static constexpr double kFar = std::numeric_limits<double>::infinity();
    std::array<double, 3> low{-kFar, -kFar, -kFar}, high{kFar, kFar, kFar};

    /// The layer that stands for the face, the first beyond it; one just within is taken too, so that no cell is flat.
    [[nodiscard]] int face_layer(int axis, bool upper) const;
    /// Layers from the face's on lie on the face, all others where they are.
    [[nodiscard]] double position(int axis, int layer) const;
    [[nodiscard]] bool on_face(int axis, int layer) const {
        return position(axis, layer) == low[axis] || position(axis, layer) == high[axis];
    }
};

/// A clipped solid's distance with the cut undone near its faces, and carried on beyond: what the wall is there.
/// Interpolation of the clipped distance rounds the edges of the cut; that of this one, clipped again, does not.
struct Uncut {
    FloatGridPtr distance;
    LatticeClip clip;
};

/// What lies beyond a face.
enum class FaceLayer {
    InPlace,  ///< kCarriedOn layers with the distance there
    OnFace    ///< one with that on the face: the layer is moved onto it, and all beyond is outside
};
inline constexpr int kCarriedOn = 4;  ///< a band's half width, and one more

/// @return none where nothing is cut, or the clip is not aligned with the lattice.
[[nodiscard]] std::optional<Uncut> uncut(const FloatGrid& surface, FaceLayer layer);

/// Largest n·x - offset: the distance to the clip's boundary inside (negative), no more than that outside.
[[nodiscard]] double depth_in(const Clip& clip, const Vec3& x);

}  // namespace covol::detail
