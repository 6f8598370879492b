#pragma once
// Marks as small balls on surfaces.
#include <vector>

#include "render/surface_view.h"

namespace covol::figure {

/// Of marks where there is one structure, or none, and of those that belong to none of several.
inline constexpr Color kLoneMark = kSkyBlue, kLooseMark{0.95F, 0.95F, 0.95F};

struct Ball {
    Vec3 place;  ///< world
    Color color;
};

/// Pixels: the more marks, the smaller.
[[nodiscard]] double mark_radius(double text, std::size_t count);

/// Draws those that no surface hides; one may lie as far as `slack` (world units) behind the surface that it marks.
void draw_balls(Canvas& canvas, const std::vector<Ball>& balls, const Camera& camera, const Layer& layer, double radius,
                double slack);

}  // namespace covol::figure
