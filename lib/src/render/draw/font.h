#pragma once
// Text in figures: outlines of a font, filled by the exact fraction of each pixel that they cover.
#include <string>

#include "render/draw/canvas.h"

namespace covol::figure {

/// The outlines of all letters. They are defined in font_data.cpp, which describes their format.
extern const char* const kGlyphs;

enum class Align { Left, Center, Right };

/// How a text looks.
struct TextStyle {
    double size = 16;  ///< of the font, pixels
    Color color{0, 0, 0};
    Align align = Align::Left;  ///< which part of the text is at x
    double halo = 0;            ///< width of a rim around the letters, pixels, which makes text on images legible
    Color halo_color{0, 0, 0};
};

/// Pixels from the first letter's origin to the end of the last one. Letters that the font lacks count as the
/// replacement character.
[[nodiscard]] double text_width(const std::string& utf8, double size);

/// @param y  of the baseline
void draw_text(Canvas& canvas, double x, double y, const std::string& utf8, const TextStyle& style);

/// Height of capital letters, in font sizes.
inline constexpr double kCapHeight = 0.73;

}  // namespace covol::figure
