#include "contours/contour_curve.h"

#include "base/geometry.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace covol::detail {
namespace {

constexpr double kLongestPiece = 1e6;  // points between two marks: limits the memory if the step is much too small

Vec3 mix(const Vec3& a, const Vec3& b, double t) {
    return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

int pieces(double length, double step) { return std::max(1, int(std::ceil(std::min(length / step, kLongestPiece)))); }

/// Barry and Goldman's pyramidal scheme: the curve through p[1] and p[2] at the fraction s between them.
Vec3 catmull_rom(const std::array<Vec3, 4>& p, double s) {
    std::array<double, 4> t{0, 0, 0, 0};
    for (int n = 1; n < 4; ++n) t[n] = t[n - 1] + std::sqrt(length(minus(p[n - 1], p[n])));
    const double at = t[1] + s * (t[2] - t[1]);
    std::array<Vec3, 4> level = p;
    for (int width = 1; width < 4; ++width)
        for (int n = 0; n + width < 4; ++n) {
            // The last round uses the middle interval alone.
            const double begin = width == 3 ? t[1] : t[n], end = width == 3 ? t[2] : t[n + width];
            level[n] = mix(level[n], level[n + 1], (at - begin) / (end - begin));
        }
    return level[0];
}

}  // namespace

std::vector<Vec3> subdivide(const std::vector<Vec3>& marks, bool closed, double step) {
    std::vector<Vec3> points;
    const std::size_t count = marks.size();
    for (std::size_t n = 0; n < count; ++n) {
        points.push_back(marks[n]);
        if (n + 1 == count && !closed) break;
        const Vec3& next = marks[(n + 1) % count];
        const int parts = pieces(length(minus(marks[n], next)), step);
        for (int part = 1; part < parts; ++part) points.push_back(mix(marks[n], next, double(part) / parts));
    }
    return points;
}

std::vector<Vec3> centripetal_curve(const std::vector<Vec3>& marks, bool closed, double step) {
    const auto count = std::ptrdiff_t(marks.size());
    if (count < 3) return marks;
    const auto at = [&](std::ptrdiff_t n) -> Vec3 {
        if (closed) return marks[std::size_t((n + count) % count)];
        // Beyond an open end the neighbour is mirrored at the end.
        if (n < 0) return mix(marks[1], marks[0], 2);
        if (n >= count) return mix(marks[std::size_t(count - 2)], marks[std::size_t(count - 1)], 2);
        return marks[std::size_t(n)];
    };
    std::vector<Vec3> curve;
    for (std::ptrdiff_t n = 0; n + 1 < count + (closed ? 1 : 0); ++n) {
        const std::array<Vec3, 4> p{at(n - 1), at(n), at(n + 1), at(n + 2)};
        const int parts = pieces(length(minus(p[1], p[2])), step);
        for (int part = 0; part < parts; ++part)
            curve.push_back(part == 0 ? p[1] : catmull_rom(p, double(part) / parts));
    }
    if (!closed) curve.push_back(marks.back());
    return curve;
}

double length_of(const std::vector<Vec3>& curve, bool closed) {
    double length = 0;
    for (std::size_t n = closed ? 0 : 1; n < curve.size(); ++n) {
        const Vec3 &a = curve[n == 0 ? curve.size() - 1 : n - 1], &b = curve[n];
        length += std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    }
    return length;
}

std::vector<Vec3> evenly_along(const std::vector<Vec3>& curve, bool closed, double step) {
    double length = 0, next = 0;
    std::vector<Vec3> kept;
    const std::size_t edges = closed ? curve.size() : curve.size() - 1;
    for (std::size_t n = 0; n < edges; ++n) {
        const Vec3 &a = curve[n], &b = curve[(n + 1) % curve.size()];
        const double edge = std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
        for (; next < length + edge; next += step) {
            const double t = (next - length) / edge;
            kept.push_back({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])});
        }
        length += edge;
    }
    if (kept.empty()) kept.push_back(curve.front());
    return kept;
}

}  // namespace covol::detail
