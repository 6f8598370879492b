#include "cloud/surface/fit_kernel.h"

#include <cstring>

#include "base/clones.h"

namespace covol::cloud {
namespace {

using Double4 = double __attribute__((vector_size(8 * kFitLanes)));
using Long4 = std::int64_t __attribute__((vector_size(8 * kFitLanes)));
using detail::Int8;

COVOL_INLINE Double4 load(const double* values) {
    Double4 v;
    std::memcpy(&v, values, sizeof v);
    return v;
}

COVOL_INLINE double sum_of(Double4 v) { return (v[0] + v[1]) + (v[2] + v[3]); }

COVOL_INLINE Double4 dot(const Double4 (&a)[3], const Double4 (&b)[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// For each of the 16 subsets (masks) of the four lanes: the number of its lanes, and the indices of their 32-bit
/// halves in ascending order, for a shuffle that moves these lanes to the front of the vector.
struct LanesFirst {
    alignas(32) std::int32_t halves[16][8] = {};
    std::size_t count[16] = {};

    constexpr LanesFirst() {
        for (std::size_t mask = 0; mask < 16; ++mask)
            for (int lane = 0; lane < 4; ++lane)
                if (mask >> lane & 1) {
                    halves[mask][2 * count[mask]] = 2 * lane;
                    halves[mask][2 * count[mask]++ + 1] = 2 * lane + 1;
                }
    }
};
constexpr LanesFirst kLanesFirst;

}  // namespace

void FitCloud::reserve(std::size_t points) {
    for (int a = 0; a < 3; ++a) place[a].reserve(points + kFitLanes), normal[a].reserve(points + kFitLanes);
    count.reserve(points + kFitLanes);
}

void FitCloud::add(const double (&at)[3], const double (&its_normal)[3], double its_count) {
    for (int a = 0; a < 3; ++a) {
        place[a].push_back(at[a]);
        normal[a].push_back(its_normal[a]);
    }
    count.push_back(its_count);
}

void FitCloud::finish() {
    for (std::size_t n = 1; n < kFitLanes; ++n) add({0, 0, 0}, {0, 0, 0}, 0);
}

void FitPoints::clear(std::size_t room) {
    room += kFitLanes;
    if (u.size() < room)
        for (std::vector<double>* values : {&u, &v, &t, &count}) values->resize(room);
    size = 0;
}

void FitPoints::fill_up() {
    for (std::size_t n = size; n % kFitLanes != 0; ++n) {
        u[n] = 1;  // so that 1 - u^2 - v^2 - t^2, and with it the weight of the padding, is 0
        v[n] = t[n] = count[n] = 0;
    }
}

COVOL_CLONES void select_near(const FitCloud& cloud, std::size_t begin, std::size_t end, const FitFrame& frame,
                              FitPoints& near) {
    // Copied to local variables because the compiler must assume that stores may alias the originals.
    const double scale = 1 / frame.radius;
    Double4 axes[3][3], origin[3];
    const double *place[3], *normals[3], *counts = cloud.count.data();
    for (int a = 0; a < 3; ++a) {
        place[a] = cloud.place[a].data();
        normals[a] = cloud.normal[a].data();
        origin[a] = Double4{} + frame.origin[a];
        for (int b = 0; b < 3; ++b) axes[a][b] = Double4{} + frame.axes[a][b];
    }
    double *u = near.u.data(), *v = near.v.data(), *t = near.t.data(), *count = near.count.data();
    std::size_t size = near.size;
    for (std::size_t n = begin; n < end; n += kFitLanes) {
        Double4 to[3], normal[3];
        for (int a = 0; a < 3; ++a) {
            to[a] = (load(place[a] + n) - origin[a]) * scale;
            normal[a] = load(normals[a] + n);
        }
        const Double4 squared = to[0] * to[0] + to[1] * to[1] + to[2] * to[2];
        const Long4 counts_here =
            (squared < 1.0) & (dot(axes[2], normal) > 0.0) & (Long4{0, 1, 2, 3} < std::int64_t(end - n));
        const Long4 bits = counts_here & Long4{1, 2, 4, 8};
        const auto mask = std::size_t((bits[0] | bits[1]) | (bits[2] | bits[3]));
        if (mask == 0) continue;
        Int8 first;
        std::memcpy(&first, kLanesFirst.halves[mask], sizeof first);
        const auto keep = [&](double* values, Double4 lanes) __attribute__((always_inline)) {
            lanes = (Double4)__builtin_shuffle((Int8)lanes, first);
            std::memcpy(values + size, &lanes, sizeof lanes);
        };
        keep(u, dot(axes[0], to));
        keep(v, dot(axes[1], to));
        keep(t, dot(axes[2], to));
        keep(count, load(counts + n));
        size += kLanesFirst.count[mask];
    }
    near.size = size;
}

COVOL_CLONES FitSums fit_sums(const FitPoints& points) {
    Double4 m[15] = {}, h[6] = {}, squares{}, nears{}, near_squares{};
    for (std::size_t n = 0; n < points.size; n += kFitLanes) {
        const Double4 u = load(&points.u[n]), v = load(&points.v[n]), t = load(&points.t[n]),
                      count = load(&points.count[n]);
        const Double4 uu = u * u, uv = u * v, vv = v * v, inside = 1 - uu - vv - t * t, near = inside * inside;
        const Double4 w = count * near, wuu = w * uu, wuv = w * uv, wvv = w * vv, wt = w * t;
        m[0] += w;
        m[1] += w * u;
        m[2] += w * v;
        m[3] += wuu;
        m[4] += wuv;
        m[5] += wvv;
        m[6] += wuu * u;
        m[7] += wuu * v;
        m[8] += wvv * u;
        m[9] += wvv * v;
        m[10] += wuu * uu;
        m[11] += wuu * uv;
        m[12] += wuu * vv;
        m[13] += wuv * vv;
        m[14] += wvv * vv;
        h[0] += wt;
        h[1] += wt * u;
        h[2] += wt * v;
        h[3] += wt * uu;
        h[4] += wt * uv;
        h[5] += wt * vv;
        squares += w * near;
        nears += near;
        near_squares += near * near;
    }
    FitSums sums;
    for (int n = 0; n < 15; ++n) sums.moments[n] = sum_of(m[n]);
    for (int n = 0; n < 6; ++n) sums.heights[n] = sum_of(h[n]);
    sums.squares = sum_of(squares);
    sums.near = sum_of(nears);
    sums.near_squares = sum_of(near_squares);
    return sums;
}

COVOL_CLONES FitResidual fit_residual(const FitPoints& points, const double x[6]) {
    Double4 squares{}, weight{}, nears{};
    for (std::size_t n = 0; n < points.size; n += kFitLanes) {
        const Double4 u = load(&points.u[n]), v = load(&points.v[n]), t = load(&points.t[n]);
        const Double4 inside = 1 - u * u - v * v;
        const Double4 off = t - (x[0] + u * (x[1] + u * x[3] + v * x[4]) + v * (x[2] + v * x[5]));
        // Points of the padding have u = 1 and thus weight 0.
        const Double4 near = inside * inside, w = load(&points.count[n]) * near;
        squares += w * off * off;
        weight += w;
        nears += near;
    }
    return {sum_of(squares), sum_of(weight), sum_of(nears)};
}

}  // namespace covol::cloud
