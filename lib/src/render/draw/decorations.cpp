#include "render/draw/decorations.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/geometry.h"

namespace covol::figure {
namespace {

constexpr double kLine = 1.45;   // distance between lines of the legend, in font sizes
constexpr double kPatch = 0.75;  // side of a square of the legend, in font sizes

std::string shown_unit(const std::string& unit) {
    if (unit == "um" || unit == "micron" || unit == "microns" || unit == "micrometer" || unit == "micrometre")
        return "µm";
    if (unit == "pixel" || unit == "pixels") return "px";
    return unit.empty() || unit == "not stated" ? "units" : unit;
}

}  // namespace

double round_length(double length) {
    if (!(length > 0) || !std::isfinite(length)) return 1;
    const double power = std::pow(10, std::floor(std::log10(length) + 1e-9));
    for (const double digit : {5.0, 2.0})
        if (digit * power <= length * (1 + 1e-9)) return digit * power;
    return power;
}

std::string short_number(double value) {
    if (!std::isfinite(value)) return "?";
    const double size = std::abs(value);
    char text[64];
    if (size >= 1e6 || (size > 0 && size < 1e-4)) {
        std::snprintf(text, sizeof text, "%.3g", value);
    } else {
        const int decimals = size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 4;
        std::snprintf(text, sizeof text, "%.*f", decimals, value);
    }
    std::string shown = text;
    if (shown.find('.') != std::string::npos && shown.find('e') == std::string::npos) {
        shown.erase(shown.find_last_not_of('0') + 1);
        if (shown.back() == '.') shown.pop_back();
    }
    if (shown == "-0") return "0";
    if (shown.front() == '-') shown.replace(0, 1, "−");
    return shown;
}

std::string length_text(double length, const std::string& unit) {
    return short_number(length) + " " + shown_unit(unit);
}

void draw_scale_bar(Canvas& canvas, double x, double y, double available, double pixel, const std::string& unit,
                    const BarStyle& style) {
    const double length = round_length(0.32 * available * pixel), width = length / pixel;
    const double thick = std::max(2.0, std::round(0.22 * style.text));
    const double right = std::round(x), left = right - width, top = std::round(y) - thick;
    for (const bool rim : {true, false}) {
        if (rim && style.rim <= 0) continue;
        const double by = rim ? std::max(1.0, std::round(style.rim)) : 0;
        for (int j = int(top - by); j < int(top + thick + by); ++j)
            for (int i = int(std::floor(left - by)); i < int(std::ceil(right + by)); ++i) {
                if (i < 0 || j < 0 || i >= canvas.width() || j >= canvas.height()) continue;
                const double in = std::clamp(std::min(i + 1.0, right + by) - std::max(double(i), left - by), 0.0, 1.0);
                canvas.blend(i, j, rim ? gray(0) : style.color, rim ? 0.6 * in : in);
            }
    }
    TextStyle text{style.text, style.color, Align::Center, style.rim, gray(0)};
    const std::string label = length_text(length, unit);
    const double half = 0.5 * text_width(label, style.text);
    draw_text(canvas, std::min(0.5 * (left + right), right + 0.3 * style.text - half), top - 0.35 * style.text, label,
              text);
}

void draw_axes(Canvas& canvas, double x, double y, double length, const Basis& basis,
               const std::array<std::string, 3>& names, double text, const Color& ink) {
    const Color colors[3] = {kVermillion, kGreen, kBlue};
    // Axes that point away from the eye are drawn first, so that the others cover them.
    std::array<int, 3> order{0, 1, 2};
    std::sort(order.begin(), order.end(), [&](int a, int b) { return basis.to_eye[a] < basis.to_eye[b]; });
    const double width = std::max(1.5, 0.12 * text);
    for (const int a : order) {
        const double dx = basis.right[a], dy = -basis.up[a], seen = std::hypot(dx, dy);
        const double tip_x = x + length * dx, tip_y = y + length * dy;
        const Color color = mix(colors[a], ink, 0.1);
        if (seen < 0.12) {  // points at the eye, or away from it
            canvas.disc(x, y, 1.6 * width, color, 1, canvas.whole());
            continue;
        }
        canvas.line({x, y}, {tip_x, tip_y}, width, color, 1, canvas.whole());
        const double ux = dx / seen, uy = dy / seen, head = std::min(0.45 * text, 0.5 * seen * length);
        for (const double side : {-1.0, 1.0})
            canvas.line({tip_x, tip_y},
                        {tip_x - head * (0.85 * ux - side * 0.5 * uy), tip_y - head * (0.85 * uy + side * 0.5 * ux)},
                        width, color, 1, canvas.whole());
        const double away = 0.62 * text;
        draw_text(canvas, tip_x + away * ux, tip_y + away * uy + 0.5 * kCapHeight * text, names[a],
                  {text, ink, Align::Center, 0, {}});
    }
}

std::array<double, 2> legend_size(const std::vector<LegendEntry>& entries, double text) {
    double width = 0;
    for (const LegendEntry& entry : entries) width = std::max(width, text_width(entry.name, text));
    return {entries.empty() ? 0 : width + 1.3 * text, (double(entries.size()) * kLine - 0.4) * text};
}

void draw_legend(Canvas& canvas, double x, double y, const std::vector<LegendEntry>& entries, double text,
                 const Color& ink) {
    const double patch = kPatch * text;
    for (std::size_t n = 0; n < entries.size(); ++n) {
        const double base = y + (double(n) * kLine + 0.85) * text, middle = base - 0.5 * kCapHeight * text;
        if (entries[n].is_mark) {
            canvas.disc(x + 0.5 * patch, middle, 0.36 * patch + 1, gray(0.1), 1, canvas.whole());
            canvas.disc(x + 0.5 * patch, middle, 0.36 * patch, entries[n].color, 1, canvas.whole());
        } else {
            canvas.fill({int(std::round(x)), int(std::round(middle - 0.5 * patch)), int(std::round(patch)),
                         int(std::round(patch))},
                        entries[n].color);
        }
        draw_text(canvas, x + 1.15 * text, base, entries[n].name, {text, ink, Align::Left, 0, {}});
    }
}

}  // namespace covol::figure
