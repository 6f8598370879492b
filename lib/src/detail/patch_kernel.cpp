#include "detail/patch_kernel.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "detail/clones.h"

namespace covol::detail {
namespace {

template <typename Real>
COVOL_INLINE Real dot(const Real (&a)[3], const float (&b)[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <typename Real>
struct Hit {
    Real squared;
    decltype(Real{} < Real{}) is_interior;
};

// The nearest point lies in the triangle whose sector, seen along the axis, holds the point that asks: within it, or on its
// side of the outline. One source for a float and for eight.
template <typename Real>
COVOL_INLINE Hit<Real> nearest_of(const PatchFan& fan, const Real (&arm)[3]) {
    constexpr bool kIsOne = std::is_same_v<Real, float>;
    const auto& axis = fan.axis;
    const Real turned[3] = {arm[1] * axis[2] - arm[2] * axis[1], arm[2] * axis[0] - arm[0] * axis[2],
                            arm[0] * axis[1] - arm[1] * axis[0]};
    Hit<Real> best{Real{} + std::numeric_limits<float>::infinity(), {}};
    Real from_side = dot(turned, fan.triangles[0].from);
    for (int n = 0; n < fan.count; ++n) {
        const PatchFan::Triangle& t = fan.triangles[n];
        const Real to_side = from_side + dot(turned, t.edge);
        const auto in_sector = (from_side >= 0.0F) & (to_side <= 0.0F);
        from_side = to_side;
        if constexpr (kIsOne)
            if (!in_sector) continue;
        const Real from_edge[3] = {arm[0] - t.from[0], arm[1] - t.from[1], arm[2] - t.from[2]};
        const auto is_interior = dot(from_edge, t.inward) > 0.0F;
        const Real off = dot(arm, t.normal);
        Real along = dot(from_edge, t.edge) * t.inverse_length;
        along = along > 0.0F ? along : Real{};
        along = along < 1.0F ? along : Real{} + 1.0F;
        const Real rest[3] = {from_edge[0] - along * t.edge[0], from_edge[1] - along * t.edge[1],
                              from_edge[2] - along * t.edge[2]};
        const Real to_edge = rest[0] * rest[0] + rest[1] * rest[1] + rest[2] * rest[2];
        const Real squared = is_interior ? off * off * t.inverse_area : to_edge;
        const auto nearer = in_sector & (squared < best.squared);
        best.squared = nearer ? squared : best.squared;
        best.is_interior = nearer ? is_interior : best.is_interior;
    }
    return best;
}

COVOL_INLINE Float8 ceil_of(Float8 x) {
    const Float8 whole = __builtin_convertvector(__builtin_convertvector(x, Int8), Float8);  // towards 0
    return whole < x ? whole + 1.0F : whole;
}

/// Positions first, first + 1, ... along an axis that lie in an interval and in the leaf.
struct Positions {
    Float8 first, last;
    int most;
    COVOL_INLINE Positions(Float8 center, float half)
        : first(ceil_of(center - half)), last(center + half), most(static_cast<int>(2 * half) + 1) {}
    COVOL_INLINE Int8 are_in(Float8 at) const { return (at <= last) & (at >= 0.0F) & (at <= 7.0F); }
    COVOL_INLINE Int8 meet_leaf() const { return (first <= 7.0F) & (last >= 0.0F); }
};

}  // namespace

PatchFan::PatchFan(const float* axis_of, const float* center, const std::array<float, 3>* vertices, int vertex_count)
    : count(vertex_count) {
    const auto cross = [](const float* a, const float* b, float* out) {
        for (int k = 0; k < 3; ++k) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    };
    const auto square = [](const float* a) { return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]; };
    std::memcpy(axis, axis_of, sizeof axis);
    for (int n = 0; n < count; ++n) {
        Triangle& t = triangles[n];
        const auto& next = vertices[n + 1 < count ? n + 1 : 0];
        for (int k = 0; k < 3; ++k) {
            t.from[k] = vertices[n][k] - center[k];
            t.edge[k] = next[k] - vertices[n][k];
        }
        cross(t.from, t.edge, t.normal);
        cross(t.normal, t.edge, t.inward);
        const float area = square(t.normal), length = square(t.edge);
        t.inverse_area = area > 0 ? 1 / area : 0.0F;
        t.inverse_length = length > 0 ? 1 / length : 0.0F;
    }
}

PatchHit nearest_on(const PatchFan& fan, const float arm[3]) {
    const float point[3] = {arm[0], arm[1], arm[2]};
    const Hit<float> hit = nearest_of(fan, point);
    return {hit.squared, hit.is_interior};
}

// Lanes lie along the axis that the polygon faces most: the cylinder's section moves from lane to lane by the slope.
COVOL_CLONES void offer_patch(const PatchFan& fan, const PatchCylinder& cylinder, std::int32_t index, const PatchLeaf& leaf) {
    constexpr int kStride[3] = {64, 8, 1};
    const auto size = [&](int a) { return std::abs(fan.axis[a]); };
    const int m = size(0) >= size(1) ? (size(0) >= size(2) ? 0 : 2) : (size(1) >= size(2) ? 1 : 2);
    const int u = (m + 1) % 3, v = (m + 2) % 3;
    if (fan.axis[m] == 0) return;
    const float slope_u = fan.axis[u] / fan.axis[m], slope_v = fan.axis[v] / fan.axis[m];
    const float radius = cylinder.radius;
    const float half = cylinder.half_width * size(m) + radius * std::sqrt(std::max(0.0F, 1 - fan.axis[m] * fan.axis[m]));
    const Float8 lane = {0, 1, 2, 3, 4, 5, 6, 7};
    const Float8 along = lane - cylinder.center[m];
    const Positions at_u(cylinder.center[u] + along * slope_u, radius * std::sqrt(1 + slope_u * slope_u));
    const Positions at_v(cylinder.center[v] + along * slope_v, radius * std::sqrt(1 + slope_v * slope_v));
    const Int8 in_m = (along <= half) & (along >= -half) & at_u.meet_leaf() & at_v.meet_leaf();
    if (!any(in_m)) return;
    for (int du = 0; du < at_u.most; ++du) {
        const Float8 pu = at_u.first + float(du);
        const Int8 in_u = in_m & at_u.are_in(pu);
        if (!any(in_u)) continue;
        for (int dv = 0; dv < at_v.most; ++dv) {
            const Float8 pv = at_v.first + float(dv);
            const Int8 here = in_u & at_v.are_in(pv);
            if (!any(here)) continue;
            Float8 arm[3];
            arm[m] = along;
            arm[u] = pu - cylinder.center[u];
            arm[v] = pv - cylinder.center[v];
            const Hit<Float8> hit = nearest_of(fan, arm);
            const Int8 voxel = __builtin_convertvector(lane * float(kStride[m]) + pu * float(kStride[u]) + pv * float(kStride[v]), Int8);
            for (int n = 0; n < 8; ++n) {
                if (!here[n]) continue;
                const int p = voxel[n];
                if (!(hit.squared[n] < leaf.squared[p])) continue;
                leaf.squared[p] = hit.squared[n];
                leaf.patch[p] = index;
                const std::uint64_t bit = std::uint64_t(1) << (p & 63);
                leaf.interior[p >> 6] = hit.is_interior[n] ? leaf.interior[p >> 6] | bit : leaf.interior[p >> 6] & ~bit;
            }
        }
    }
}

}  // namespace covol::detail
