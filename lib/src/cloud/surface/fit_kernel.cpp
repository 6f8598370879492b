#include "cloud/surface/fit_kernel.h"

#include <cstring>

#include "base/clones.h"

namespace covol::cloud {
namespace {

using Double4 = double __attribute__((vector_size(8 * kFitLanes)));

COVOL_INLINE Double4 load(const std::vector<double>& values, std::size_t at) {
    Double4 v;
    std::memcpy(&v, values.data() + at, sizeof v);
    return v;
}

COVOL_INLINE double sum_of(Double4 v) { return (v[0] + v[1]) + (v[2] + v[3]); }

}  // namespace

void FitPoints::clear() {
    for (std::vector<double>* values : {&u, &v, &t, &count}) values->clear();
    size = 0;
}

void FitPoints::fill_up() {
    const std::size_t full = (size + kFitLanes - 1) / kFitLanes * kFitLanes;
    u.resize(full, 1.0);  // where the weight is 0
    for (std::vector<double>* values : {&v, &t, &count}) values->resize(full, 0.0);
}

COVOL_CLONES FitSums fit_sums(const FitPoints& points) {
    Double4 m[15] = {}, h[6] = {}, squares{}, nears{}, near_squares{};
    for (std::size_t n = 0; n < points.size; n += kFitLanes) {
        const Double4 u = load(points.u, n), v = load(points.v, n), t = load(points.t, n),
                      count = load(points.count, n);
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
        const Double4 u = load(points.u, n), v = load(points.v, n), t = load(points.t, n);
        const Double4 inside = 1 - u * u - v * v;
        const Double4 off = t - (x[0] + u * (x[1] + u * x[3] + v * x[4]) + v * (x[2] + v * x[5]));
        // Points that fill up have u = 1 and no weight.
        const Double4 near = inside * inside, w = load(points.count, n) * near;
        squares += w * off * off;
        weight += w;
        nears += near;
    }
    return {sum_of(squares), sum_of(weight), sum_of(nears)};
}

}  // namespace covol::cloud
