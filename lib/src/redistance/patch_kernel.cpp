#include "redistance/patch_kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "base/clones.h"

namespace covol::detail {
namespace {

// Triangles with a smaller area or angle get no normal, see PatchFan::make().
constexpr float kSmallestArea = 1e-24F;  // [voxels^4] squared: edges of a millionth of a voxel
constexpr float kSmallestAngle = 1e-4F;

template <typename Real>
COVOL_INLINE Real dot(const Real (&a)[3], const float (&b)[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <typename Real>
struct Hit {
    Real squared;
    decltype(Real{} < Real{}) is_interior;
};

template <typename Real>
COVOL_INLINE Real unit(Real x) {
    x = x > 0.0F ? x : Real{};
    return x < 1.0F ? x : Real{} + 1.0F;
}

// The nearest point lies in a triangle, on the common edge of two triangles, or on the outline. Real is a float or a
// vector of eight.
template <typename Real>
COVOL_INLINE Hit<Real> nearest_of(const PatchFan& fan, const Real (&arm)[3]) {
    Real within = Real{} + std::numeric_limits<float>::infinity(), outline = within;
    const auto keep_min = [](Real & minimum, Real squared) __attribute__((always_inline)) {
        minimum = squared < minimum ? squared : minimum;
    };
    const Real first = dot(arm, fan.triangles[0].from);
    Real from = first;
    for (int n = 0; n < fan.count; ++n) {
        const PatchFan::Triangle& t = fan.triangles[n];
        const Real to = n + 1 < fan.count ? dot(arm, fan.triangles[n + 1].from) : first;
        const Real beside_to = t.to_to * from - t.from_to * to, beside_from = t.from_from * to - t.from_to * from;
        const auto inside = (beside_to >= 0.0F) & (beside_from >= 0.0F) & (beside_to + beside_from <= t.area);
        const Real off = dot(arm, t.normal);
        const Real plane = off * off * t.inverse_area;
        within = (inside & (plane < within)) ? plane : within;

        const Real along = unit(from * t.inverse_from);
        const Real spoke[3] = {arm[0] - along * t.from[0], arm[1] - along * t.from[1], arm[2] - along * t.from[2]};
        keep_min(within, spoke[0] * spoke[0] + spoke[1] * spoke[1] + spoke[2] * spoke[2]);

        const Real side[3] = {arm[0] - t.from[0], arm[1] - t.from[1], arm[2] - t.from[2]};
        const Real on_edge = unit(dot(side, t.edge) * t.inverse_edge);
        const Real rest[3] = {side[0] - on_edge * t.edge[0], side[1] - on_edge * t.edge[1],
                              side[2] - on_edge * t.edge[2]};
        keep_min(outline, rest[0] * rest[0] + rest[1] * rest[1] + rest[2] * rest[2]);
        from = to;
    }
    return {within < outline ? within : outline, within < outline};
}

COVOL_INLINE Float8 positive(Float8 x) { return x > 0.0F ? x : Float8{}; }

COVOL_INLINE Float8 ceil_of(Float8 x) {
    // The conversion to integers rounds towards 0.
    const Float8 whole = __builtin_convertvector(__builtin_convertvector(x, Int8), Float8);
    return whole < x ? whole + 1.0F : whole;
}

/// The integer positions along an axis within `half` of a centre that differs from lane to lane: first, first + 1, ...,
/// at most `maximum` of them.
struct Positions {
    Float8 first;
    int maximum;
    Int8 meet_leaf;
    COVOL_INLINE Positions(Float8 center, float half)
        : first(ceil_of(center - half)),
          maximum(static_cast<int>(2 * half) + 1),
          meet_leaf((first <= 7.0F) & (center + half >= 0.0F)) {}
};

COVOL_INLINE Int8 is_in_leaf(Int8 at) { return (at & ~7) == 0; }

/// A lower bound of the squared distance to a polygon that lies in a cylinder, for a position `along` the axis and with
/// the squared distance `outside` from it.
COVOL_INLINE Float8 min_square(const PatchCylinder& cylinder, Float8 along, Float8 outside) {
    const Float8 above = positive((along < 0.0F ? -along : along) - cylinder.patch_height);
    // With q for `outside` and r for the radius: (sqrt(q) - r)² >= (q - r²)² / (4 q) for q >= r². This bound needs no
    // square root.
    const Float8 excess = positive(outside - cylinder.patch_radius * cylinder.patch_radius);
    return (1 - 1e-5F) * (above * above + 0.25F * excess * excess / (outside + 1e-12F));
}

}  // namespace

PatchFan::PatchFan(const PatchOutline& outline) { make(outline); }

void PatchFan::make(const PatchOutline& outline) {
    count = outline.count;
    const auto* vertices = outline.vertices;
    const auto product = [](const float* a, const float* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    for (int n = 0; n < count; ++n) {
        Triangle& t = triangles[n];
        const auto& next = vertices[n + 1 < count ? n + 1 : 0];
        float to[3];
        for (int k = 0; k < 3; ++k) {
            t.from[k] = vertices[n][k] - outline.center[k];
            to[k] = next[k] - outline.center[k];
            t.edge[k] = next[k] - vertices[n][k];
        }
        for (int k = 0; k < 3; ++k)
            t.normal[k] = t.from[(k + 1) % 3] * to[(k + 2) % 3] - t.from[(k + 2) % 3] * to[(k + 1) % 3];
        t.from_from = product(t.from, t.from), t.from_to = product(t.from, to), t.to_to = product(to, to);
        t.area = product(t.normal, t.normal);
        const auto inverse = [](float square) { return square > 0 ? 1 / square : 0.0F; };
        t.inverse_from = inverse(t.from_from);
        t.inverse_edge = inverse(product(t.edge, t.edge));
        // The normal of so narrow or small a triangle is dominated by rounding and is not used. The triangle's edges
        // are practically as near to any position as its interior.
        if (!(t.area > std::max(kSmallestArea, kSmallestAngle * kSmallestAngle * t.from_from * t.to_to))) {
            t.area = 0;
            std::fill_n(t.normal, 3, 0.0F);
        }
        t.inverse_area = 1 / t.area;  // without a normal infinite: nearest_of() then computes NaN and ignores it
    }
}

PatchHit nearest_on(const PatchFan& fan, const float arm[3]) {
    const float point[3] = {arm[0], arm[1], arm[2]};
    const Hit<float> hit = nearest_of(fan, point);
    return {hit.squared, hit.is_interior};
}

// The eight lanes are voxels along axis m, the one closest to the polygon's normal. From lane to lane, the centre of
// the cylinder's section moves by slope_u and slope_v along the other two axes.
COVOL_CLONES void offer_patch(const PatchOutline& outline, const PatchCylinder& cylinder, std::int32_t index,
                              const PatchLeaf& leaf, PatchFan& fan) {
    constexpr int kStride[3] = {64, 8, 1};
    const float* axis = outline.axis;
    const auto size = [&](int a) { return std::abs(axis[a]); };
    const int m = size(0) >= size(1) ? (size(0) >= size(2) ? 0 : 2) : (size(1) >= size(2) ? 1 : 2);
    const int u = (m + 1) % 3, v = (m + 2) % 3;
    if (axis[m] == 0) return;
    const float slope_u = axis[u] / axis[m], slope_v = axis[v] / axis[m];
    const float radius = cylinder.radius;
    const float half = cylinder.half_width * size(m) + radius * std::sqrt(std::max(0.0F, 1 - axis[m] * axis[m]));
    const Float8 lane = {0, 1, 2, 3, 4, 5, 6, 7};
    const Float8 arm_m = lane - cylinder.center[m];
    const Positions at_u(cylinder.center[u] + arm_m * slope_u, radius * std::sqrt(1 + slope_u * slope_u));
    const Positions at_v(cylinder.center[v] + arm_m * slope_v, radius * std::sqrt(1 + slope_v * slope_v));
    const Int8 in_m = (arm_m <= half) & (arm_m >= -half) & at_u.meet_leaf & at_v.meet_leaf;
    if (!any(in_m)) return;
    const Int8 voxel_m = __builtin_convertvector(lane * float(kStride[m]), Int8);
    for (int du = 0; du < at_u.maximum; ++du) {
        const Float8 pu = at_u.first + float(du);
        const Int8 iu = __builtin_convertvector(pu, Int8);
        const Int8 in_u = in_m & is_in_leaf(iu);
        if (!any(in_u)) continue;
        const Float8 arm_u = pu - cylinder.center[u];
        const Float8 along_u = arm_m * axis[m] + arm_u * axis[u], square_u = arm_m * arm_m + arm_u * arm_u;
        for (int dv = 0; dv < at_v.maximum; ++dv) {
            const Float8 pv = at_v.first + float(dv);
            const Int8 iv = __builtin_convertvector(pv, Int8);
            const Float8 arm_v = pv - cylinder.center[v];
            const Float8 along = along_u + arm_v * axis[v];
            const Float8 outside = positive(square_u + arm_v * arm_v - along * along);
            const Int8 here = in_u & is_in_leaf(iv);
            if (!any(here)) continue;
            const Int8 voxel = here & (voxel_m + iu * kStride[u] + iv * kStride[v]);
            Float8 known;
            for (int n = 0; n < 8; ++n) known[n] = leaf.squared[voxel[n]];
            const Int8 open = here & (min_square(cylinder, along, outside) < known);
            if (!any(open)) continue;
            if (fan.count == 0) fan.make(outline);
            Float8 arm[3];
            arm[m] = arm_m;
            arm[u] = arm_u;
            arm[v] = arm_v;
            const Hit<Float8> hit = nearest_of(fan, arm);
            const Int8 nearer = open & (hit.squared < known);
            if (!any(nearer)) continue;
            for (int n = 0; n < 8; ++n)
                if (nearer[n]) leaf.take(voxel[n], {hit.squared[n], hit.is_interior[n] != 0}, index);
        }
    }
}

}  // namespace covol::detail
