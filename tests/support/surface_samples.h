#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "covol/domain.h"

// Points of known surfaces with their outward normals, with which results of the modules for clouds are compared.
namespace covol::test {

using SignedDistance = std::function<double(const Vec3&)>;  ///< negative inside

struct SurfaceSample {
    std::vector<Vec3> points, normals;
    double area = 0;  ///< of the surface, from the fraction of the box that is close to it
    [[nodiscard]] double spacing() const { return std::sqrt(area / double(points.size())); }
};

inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec3 scaled(double s, const Vec3& v) { return {s * v[0], s * v[1], s * v[2]}; }
inline Vec3 sum(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline double norm(const Vec3& v) { return std::sqrt(dot(v, v)); }
inline Vec3 unit(const Vec3& v) { return scaled(1 / norm(v), v); }

inline Vec3 normal_of(const SignedDistance& f, const Vec3& x) {
    Vec3 g;
    for (int a = 0; a < 3; ++a) {
        Vec3 low = x, high = x;
        low[a] -= 1e-6;
        high[a] += 1e-6;
        g[a] = f(high) - f(low);
    }
    return unit(g);
}

/// Random points of the surface in the box, evenly spread: points in a thin layer around it, projected onto it.
inline SurfaceSample sample_surface(const SignedDistance& f, const WorldBox& box, std::size_t count, unsigned seed) {
    constexpr double kLayer = 0.01;  // half of the layer's thickness: small compared with every shape here
    std::mt19937 random(seed);
    SurfaceSample sample;
    double tries = 0, volume = 1;
    for (int a = 0; a < 3; ++a) volume *= box.max[a] - box.min[a];
    while (sample.points.size() < count) {
        Vec3 x;
        for (int a = 0; a < 3; ++a) x[a] = box.min[a] + (box.max[a] - box.min[a]) * (random() / 4294967296.0);
        ++tries;
        if (std::abs(f(x)) > kLayer) continue;
        for (int n = 0; n < 3; ++n) x = sum(x, scaled(-f(x), normal_of(f, x)));
        sample.points.push_back(x);
        sample.normals.push_back(normal_of(f, x));
    }
    sample.area = volume * double(count) / tries / (2 * kLayer);
    return sample;
}

/// Moves each point along its normal by a normally distributed distance.
inline void add_noise(SurfaceSample& sample, double sigma, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> off(0, sigma);
    for (std::size_t n = 0; n < sample.points.size(); ++n)
        sample.points[n] = sum(sample.points[n], scaled(off(random), sample.normals[n]));
}

/// A solid, given by its signed distance, and a box around it.
struct Solid3 {
    SignedDistance distance;
    WorldBox box;
    [[nodiscard]] SurfaceSample sample(std::size_t count, unsigned seed) const {
        return sample_surface(distance, box, count, seed);
    }
};

inline Solid3 ball(double radius) {
    const double r = radius + 0.02;
    return {[radius](const Vec3& p) { return norm(p) - radius; }, {{-r, -r, -r}, {r, r, r}}};
}

/// A torus around the z axis: a tube of radius `tube` along a circle of radius `around`.
inline Solid3 torus(double around, double tube) {
    const double r = around + tube + 0.02, z = tube + 0.02;
    return {[around, tube](const Vec3& p) { return std::hypot(std::hypot(p[0], p[1]) - around, p[2]) - tube; },
            {{-r, -r, -z}, {r, r, z}}};
}

/// A ball with a cavity in its centre.
inline Solid3 shell(double outer, double inner) {
    const double r = outer + 0.02;
    return {[outer, inner](const Vec3& p) { return std::max(norm(p) - outer, inner - norm(p)); },
            {{-r, -r, -r}, {r, r, r}}};
}

/// A box around the origin.
inline Solid3 block(const Vec3& half) {
    const auto distance = [half](const Vec3& p) {
        Vec3 beyond;
        double maximum = -1e30;
        for (int a = 0; a < 3; ++a) {
            beyond[a] = std::max(0.0, std::abs(p[a]) - half[a]);
            maximum = std::max(maximum, std::abs(p[a]) - half[a]);
        }
        return norm(beyond) + std::min(0.0, maximum);
    };
    return {distance,
            {{-half[0] - 0.02, -half[1] - 0.02, -half[2] - 0.02}, {half[0] + 0.02, half[1] + 0.02, half[2] + 0.02}}};
}

/// Distance to a capsule: all points within `radius` of the segment from a to b.
inline double capsule(const Vec3& p, const Vec3& a, const Vec3& b, double radius) {
    const Vec3 along = sum(b, scaled(-1, a)), to = sum(p, scaled(-1, a));
    const double t = std::clamp(dot(to, along) / dot(along, along), 0.0, 1.0);
    return norm(sum(to, scaled(-t, along))) - radius;
}

/// A horizontal body on four legs.
inline Solid3 table(double leg) {
    const auto distance = [leg](const Vec3& p) {
        double minimum = capsule(p, {-0.5, 0, 0}, {0.5, 0, 0}, 0.3);
        for (const double x : {-0.55, 0.55})
            for (const double y : {-0.15, 0.15})
                minimum = std::min(minimum, capsule(p, {x, y, 0}, {1.3 * x, 2 * y, -0.9}, leg));
        return minimum;
    };
    return {distance, {{-0.85, -0.4, -1}, {0.85, 0.4, 0.35}}};
}

}  // namespace covol::test
