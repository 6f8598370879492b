#pragma once
// Rays through level sets: what of them is seen.
#include <vector>

#include "covol/run.h"
#include "render/draw/camera.h"
#include "render/draw/color.h"

namespace covol::figure {

/// A level set as a view shows it.
struct Body {
    const FloatGrid* surface = nullptr;
    Color color{};
    double opacity = 1;  ///< of one layer seen from straight above; 1 hides what is behind
};

/// What a view shows, before a background: colours times their share of each pixel.
struct Layer {
    int width = 0, height = 0;
    std::vector<Color> color;
    std::vector<float> fraction;
    std::vector<float> depth;  ///< of the first surface, towards the eye from the camera's center; far away: -infinity
    std::vector<float> solid;  ///< the same of the first that hides all behind it
};

/// One ray for each pixel, and sixteen where neighbours differ.
/// @throws Error InvalidInput (a grid that is no level set), Cancelled.
[[nodiscard]] Layer cast_surfaces(const std::vector<Body>& bodies, const Camera& camera, const RunContext& run);

/// Puts the layer onto the picture, at the camera's part of it.
void compose(const Layer& layer, const Rect& at, Canvas& canvas);

}  // namespace covol::figure
