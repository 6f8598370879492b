#pragma once
// Indications of a picture's scale, directions and colours.
#include <string>
#include <vector>

#include "render/draw/camera.h"
#include "render/draw/font.h"

namespace covol::figure {

/// The largest 1, 2 or 5 times a power of ten that is not above `length`.
[[nodiscard]] double round_length(double length);

/// "50 µm"; "50 units" if the unit is unknown.
[[nodiscard]] std::string length_text(double length, const std::string& unit);

/// A number with at most four decimals, fewer for larger numbers, and without trailing zeros; below 1e-4 and from 1e6
/// on, three significant digits and a power of ten.
[[nodiscard]] std::string short_number(double value);

struct BarStyle {
    Color color{1, 1, 1};
    double text = 16;  ///< size of the font, pixels
    double rim = 0;    ///< width of a dark rim, pixels, which makes bars on images visible
};
/// A bar of a round length, 13 to 32 % of `available` (pixels), with its text above; its lower right corner is at x, y.
void draw_scale_bar(Canvas& canvas, double x, double y, double available, double pixel, const std::string& unit,
                    const BarStyle& style);

/// Three arrows from the position x, y along the world's axes.
/// @param names  of the axes' positive ends
void draw_axes(Canvas& canvas, double x, double y, double length, const Basis& basis,
               const std::array<std::string, 3>& names, double text, const Color& ink);

struct LegendEntry {
    std::string name;
    Color color;
    bool is_mark = false;  ///< drawn as a dot; otherwise as a square
};
/// The legend's width and height in pixels.
[[nodiscard]] std::array<double, 2> legend_size(const std::vector<LegendEntry>& entries, double text);
/// @param x, y  the legend's upper left corner
void draw_legend(Canvas& canvas, double x, double y, const std::vector<LegendEntry>& entries, double text,
                 const Color& ink);

}  // namespace covol::figure
