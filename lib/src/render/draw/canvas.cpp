#include "render/draw/canvas.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace covol::figure {
namespace {

/// Calls visit(column, row, x, y), with the position of the centre, for the pixels in `clip` and in the picture that a
/// shape with the corners (x0, y0) and (x1, y1) may touch.
template <typename Visit>
void visit_pixels(double x0, double y0, double x1, double y1, const Rect& clip, const Rect& whole, const Visit& visit) {
    const auto low = [](double v, int a, int b) { return int(std::floor(std::max(v - 1, double(std::max(a, b))))); };
    const auto high = [](double v, int a, int b) { return int(std::ceil(std::min(v + 1, double(std::min(a, b))))); };
    for (int y = low(y0, clip.y, whole.y); y < high(y1, clip.bottom(), whole.bottom()); ++y)
        for (int x = low(x0, clip.x, whole.x); x < high(x1, clip.right(), whole.right()); ++x)
            visit(x, y, x + 0.5, y + 0.5);
}

}  // namespace

Canvas::Canvas(int width, int height, const Color& background)
    : width_(width), height_(height), pixels_(std::size_t(width) * height, background) {}

void Canvas::blend(int x, int y, const Color& color, double fraction) {
    Color& pixel = at(x, y);
    pixel = mix(pixel, color, fraction);
}

void Canvas::fill(const Rect& rect, const Color& color, double fraction) {
    visit_pixels(rect.x + 1, rect.y + 1, rect.right() - 1, rect.bottom() - 1, rect, whole(),
                 [&](int x, int y, double, double) { blend(x, y, color, fraction); });
}

void Canvas::line(const std::array<double, 2>& from, const std::array<double, 2>& to, double width, const Color& color,
                  double fraction, const Rect& clip) {
    const double dx = to[0] - from[0], dy = to[1] - from[1], square = dx * dx + dy * dy, half = 0.5 * width;
    visit_pixels(std::min(from[0], to[0]) - half, std::min(from[1], to[1]) - half, std::max(from[0], to[0]) + half,
                 std::max(from[1], to[1]) + half, clip, whole(), [&](int x, int y, double px, double py) {
                     const double t =
                         square > 0 ? std::clamp(((px - from[0]) * dx + (py - from[1]) * dy) / square, 0.0, 1.0) : 0.0;
                     const double away = std::hypot(px - from[0] - t * dx, py - from[1] - t * dy);
                     const double in = std::clamp(half + 0.5 - away, 0.0, 1.0);
                     if (in > 0) blend(x, y, color, fraction * in);
                 });
}

void Canvas::disc(double x, double y, double radius, const Color& color, double fraction, const Rect& clip) {
    visit_pixels(x - radius, y - radius, x + radius, y + radius, clip, whole(),
                 [&](int i, int j, double px, double py) {
                     const double in = std::clamp(radius + 0.5 - std::hypot(px - x, py - y), 0.0, 1.0);
                     if (in > 0) blend(i, j, color, fraction * in);
                 });
}

Picture Canvas::picture() const {
    Picture picture{width_, height_, std::vector<std::uint8_t>(3 * pixels_.size())};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pixels_.size(), 1 << 16), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n)
            for (int c = 0; c < 3; ++c)
                picture.rgb[3 * n + c] = std::uint8_t(std::lround(255 * std::clamp(pixels_[n][c], 0.0F, 1.0F)));
    });
    return picture;
}

}  // namespace covol::figure
