#include "render/marks.h"

#include <algorithm>
#include <cmath>

namespace covol::figure {

double mark_radius(double text, std::size_t count) {
    return std::max(1.2, text * std::clamp(0.30 * std::sqrt(400.0 / std::max<double>(1, double(count))), 0.08, 0.24));
}

void draw_balls(Canvas& canvas, const std::vector<Ball>& balls, const Camera& camera, const Layer& layer, double radius,
                double slack) {
    struct Seen {
        double x, y, depth;
        Color color;
        bool is_behind_translucent;
    };
    std::vector<Seen> seen;
    const double reach = slack + 1.5 * radius * camera.pixel;
    for (const Ball& ball : balls) {
        const auto [x, y, depth] = camera.project(ball.place);
        const int i = int(std::floor(x)) - camera.at.x, j = int(std::floor(y)) - camera.at.y;
        if (i < 0 || j < 0 || i >= layer.width || j >= layer.height) continue;
        const std::size_t n = std::size_t(j) * layer.width + i;
        if (depth + reach < layer.solid[n]) continue;
        seen.push_back({x, y, depth, ball.color, depth + reach < layer.depth[n]});
    }
    std::sort(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) { return a.depth < b.depth; });
    for (const Seen& ball : seen) {
        const double fraction = ball.is_behind_translucent ? 0.45 : 1;
        const Rect& clip = camera.at;
        canvas.disc(ball.x, ball.y, radius + std::max(0.5, 0.18 * radius), gray(0.08), 0.8 * fraction, clip);
        canvas.disc(ball.x, ball.y, radius, ball.color, fraction, clip);
        if (radius > 2.2)
            canvas.disc(ball.x - 0.3 * radius, ball.y - 0.3 * radius, 0.3 * radius, gray(1), 0.55 * fraction, clip);
    }
}

}  // namespace covol::figure
