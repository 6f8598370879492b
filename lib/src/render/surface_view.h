#pragma once
// Ray casting of level sets.
#include <vector>

#include "covol/run.h"
#include "render/draw/camera.h"
#include "render/draw/color.h"

namespace covol::figure {

/// A level set in a view.
struct Body {
    const FloatGrid* surface = nullptr;
    Color color{};
    double opacity = 1;  ///< of the surface where a ray meets it perpendicularly; 1 hides everything behind the surface
};

/// The content of a view without background: colours multiplied by their fraction of each pixel.
struct Layer {
    int width = 0, height = 0;
    std::vector<Color> color;
    std::vector<float> fraction;
    /// By pixel: position of the first surface, measured from the camera's center towards the eye; -infinity if there
    /// is none.
    std::vector<float> depth;
    std::vector<float> solid;  ///< the same for the first surface that hides everything behind it
};

/// Casts one ray for each pixel, and sixteen for pixels that differ from their neighbours.
/// @throws Error InvalidInput (a grid that is not a level set), Cancelled.
[[nodiscard]] Layer cast_surfaces(const std::vector<Body>& bodies, const Camera& camera, const RunContext& run);

/// Composites the layer onto the picture, in the camera's part of it.
void compose(const Layer& layer, const Rect& at, Canvas& canvas);

}  // namespace covol::figure
