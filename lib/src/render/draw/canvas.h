#pragma once
// A picture into which shapes are drawn with smooth edges.
#include <array>
#include <cstddef>
#include <vector>

#include "covol/picture.h"
#include "render/draw/color.h"

namespace covol::figure {

/// A part of a picture; x to the right, y down, in pixels.
struct Rect {
    int x = 0, y = 0, width = 0, height = 0;
    [[nodiscard]] int right() const { return x + width; }
    [[nodiscard]] int bottom() const { return y + height; }
};

/// Positions of shapes are in pixels from the upper left corner of the picture: the centre of its first pixel is at
/// (0.5, 0.5). Parts outside the picture or outside `clip` are not drawn.
class Canvas {
public:
    Canvas(int width, int height, const Color& background);
    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    [[nodiscard]] Rect whole() const { return {0, 0, width_, height_}; }
    [[nodiscard]] Color& at(int x, int y) { return pixels_[std::size_t(y) * width_ + x]; }
    /// Covers a fraction of a pixel, 0 to 1, with the colour.
    void blend(int x, int y, const Color& color, double fraction);

    void fill(const Rect& rect, const Color& color, double fraction = 1);
    void line(const std::array<double, 2>& from, const std::array<double, 2>& to, double width, const Color& color,
              double fraction, const Rect& clip);
    void disc(double x, double y, double radius, const Color& color, double fraction, const Rect& clip);

    [[nodiscard]] Picture picture() const;

private:
    int width_, height_;
    std::vector<Color> pixels_;
};

}  // namespace covol::figure
