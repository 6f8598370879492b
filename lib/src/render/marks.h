#pragma once
// Marks as small balls on surfaces.
#include <vector>

#include "render/surface_view.h"

namespace covol::figure {

/// Colours of marks if there is at most one structure, and of marks that belong to none of several.
inline constexpr Color kLoneMark = kSkyBlue, kLooseMark{0.95F, 0.95F, 0.95F};

struct Ball {
    Vec3 place;  ///< world
    Color color;
};

/// Radius of the balls in pixels: proportional to the height of the text, and smaller if there are more marks.
[[nodiscard]] double mark_radius(double text, std::size_t count);

/// Draws the balls that no surface hides. Balls up to `slack` (world units) behind a surface count as lying on it.
void draw_balls(Canvas& canvas, const std::vector<Ball>& balls, const Camera& camera, const Layer& layer, double radius,
                double slack);

}  // namespace covol::figure
