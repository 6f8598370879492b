#include "cloud/surface/crease.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "base/median.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/surface/heuristics.h"

namespace covol::cloud {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr std::size_t kPlanePoints = 5;     // minimum number of points on a plane
constexpr std::size_t kQuadricPoints = 10;  // minimum number of points on a quadric
constexpr double kFlat = 1e-3;              // [radii] misfit below which a fit counts as exact
constexpr int kRobustTurns = 3;             // iterations of reweighting by distance
constexpr int kTurns = 6;                   // maximum number of iterations of k-planes

/// Points, and for each the index of the sheet to which it belongs.
struct Parts {
    static constexpr std::size_t kAll = 3;  // as an argument of bend(): all points instead of those of one sheet
    const std::vector<CreasePoint>& points;
    double radius;
    std::vector<std::uint8_t> of;
    std::vector<double> weights;  // of the points; reweight() reduces them with the distance from the sheet

    Parts(const std::vector<CreasePoint>& all, double r) : points(all), radius(r) {
        for (const CreasePoint& p : points) weights.push_back(p.weight);
    }

    /// Reduces the weights of points with their distance from their sheet (Cauchy's weights, squared), so that a few
    /// points beyond another crease do not tilt the sheet.
    void reweight(const std::array<Sheet, 3>& sheets) {
        std::vector<double> off(points.size());
        for (std::size_t n = 0; n < points.size(); ++n) off[n] = std::abs(sheets[of[n]].distance(points[n].place));
        const double scale = std::max(kFlat * radius, 2 * median(off));
        for (std::size_t n = 0; n < points.size(); ++n) {
            const double trust = 1 / (1 + off[n] * off[n] / (scale * scale));
            weights[n] = points[n].weight * trust * trust;
        }
    }

    [[nodiscard]] bool plane(std::size_t part, Sheet& sheet) const {
        Vector3d mean = Vector3d::Zero(), normal = Vector3d::Zero();
        double weight = 0;
        std::size_t count = 0;
        for (std::size_t n = 0; n < points.size(); ++n)
            if (of[n] == part) {
                const CreasePoint& p = points[n];
                mean += weights[n] * Eigen::Map<const Vector3d>(p.place.data());
                normal += weights[n] * Eigen::Map<const Vector3d>(p.normal.data());
                weight += weights[n];
                ++count;
            }
        if (count < kPlanePoints) return false;
        mean /= weight;
        Matrix3d spread = Matrix3d::Zero();
        for (std::size_t n = 0; n < points.size(); ++n)
            if (of[n] == part) {
                const Vector3d off = Eigen::Map<const Vector3d>(points[n].place.data()) - mean;
                spread += weights[n] * off * off.transpose();
            }
        Eigen::SelfAdjointEigenSolver<Matrix3d> solver;
        solver.computeDirect(spread);
        Vector3d up = solver.eigenvectors().col(0);
        if (up.dot(normal) < 0) up = -up;
        sheet.origin = {mean[0], mean[1], mean[2]};
        sheet.axes = frame_of({up[0], up[1], up[2]});
        sheet.c = {};
        return true;
    }

    /// Replaces a plane by a quadric over it, fitted to the points of one sheet, unless these are too few.
    void bend(std::size_t part, Sheet& sheet) const {
        Matrix6 m = Matrix6::Zero();
        Vector6 right = Vector6::Zero();
        std::size_t count = 0;
        double sum = 0;
        for (std::size_t n = 0; n < points.size(); ++n)
            if (part == kAll || of[n] == part) {
                const Vec3 to = minus(points[n].place, sheet.origin);
                const double u = dot(to, sheet.axes[0]) / radius, v = dot(to, sheet.axes[1]) / radius;
                Vector6 x;
                x << 1, u, v, u * u, u * v, v * v;
                m += weights[n] * x * x.transpose();
                right += weights[n] * dot(to, sheet.axes[2]) / radius * x;
                sum += weights[n];
                ++count;
            }
        if (count < kQuadricPoints) return;
        for (int d = 3; d < 6; ++d) m(d, d) += kFit.ridge * sum;
        const Vector6 x = m.ldlt().solve(right);
        if (!x.allFinite()) return;
        sheet.c = {x[0] * radius, x[1], x[2], x[3] / radius, x[4] / radius, x[5] / radius};
    }

    /// Assigns each point to its closest sheet. @return whether any assignment changed
    template <typename Distance>
    bool assign(const std::array<Sheet, 3>& sheets, std::size_t count, const Distance& distance) {
        bool changed = false;
        for (std::size_t n = 0; n < points.size(); ++n) {
            std::size_t best = 0;
            double smallest = std::numeric_limits<double>::infinity();
            for (std::size_t s = 0; s < count; ++s)
                if (const double off = std::abs(distance(sheets[s], points[n].place)); off < smallest) {
                    smallest = off;
                    best = s;
                }
            changed |= of[n] != best;
            of[n] = std::uint8_t(best);
        }
        return changed;
    }
};

/// Divides the points into `count` parts by their normals, starting from the normals that differ most.
/// @return false if these normals differ too little for a crease
bool divide(Parts& parts, std::size_t count) {
    const std::vector<CreasePoint>& points = parts.points;
    Vector3d mean = Vector3d::Zero();
    for (const CreasePoint& p : points) mean += p.weight * Eigen::Map<const Vector3d>(p.normal.data());
    mean.normalize();
    std::vector<Vec3> centres{{mean[0], mean[1], mean[2]}};
    for (std::size_t c = 0; c < count; ++c) {
        double farthest = 2;
        Vec3 next{};
        for (const CreasePoint& p : points) {
            double close = -2;
            for (const Vec3& centre : centres) close = std::max(close, dot(centre, p.normal));
            if (close < farthest) {
                farthest = close;
                next = p.normal;
            }
        }
        if (c == 1 && farthest > kCloud.same_sheet) return false;
        if (c == 0) centres.clear();
        centres.push_back(next);
    }
    parts.of.resize(points.size());
    for (int turn = 0; turn < 3; ++turn) {
        std::vector<Vec3> sums(count, Vec3{0, 0, 0});
        for (std::size_t n = 0; n < points.size(); ++n) {
            std::size_t best = 0;
            for (std::size_t c = 1; c < count; ++c)
                if (dot(centres[c], points[n].normal) > dot(centres[best], points[n].normal)) best = c;
            parts.of[n] = std::uint8_t(best);
            sums[best] = plus(sums[best], points[n].weight, points[n].normal);
        }
        for (std::size_t c = 0; c < count; ++c) centres[c] = unit(sums[c]);
    }
    return true;
}

/// Whether the solid is convex at the crease between two sheets: the points of each of them are, on average, below the
/// other one.
bool is_convex(const Parts& parts, const std::array<Sheet, 3>& sheets, std::size_t a, std::size_t b) {
    double above = 0;
    for (std::size_t n = 0; n < parts.points.size(); ++n)
        if (parts.of[n] == a || parts.of[n] == b)
            above += parts.points[n].weight * sheets[parts.of[n] == a ? b : a].distance(parts.points[n].place);
    return above < 0;
}

void combine(const Parts& parts, Crease& crease) {
    auto& sheets = crease.sheets;
    if (crease.count == 2) {
        crease.first_is_convex = is_convex(parts, sheets, 0, 1);
        return;
    }
    const bool with[3] = {is_convex(parts, sheets, 1, 2), is_convex(parts, sheets, 0, 2),
                          is_convex(parts, sheets, 0, 1)};  // index: the sheet that is not in the pair
    const int convex = with[0] + with[1] + with[2];
    crease.first_is_convex = convex >= 2;
    crease.others_are_convex = convex == 3 || convex == 1;
    // If one of the three pairs is convex and the other two are not, or the reverse, the sheet that does not belong to
    // this pair must come first, because Crease first combines the second sheet with the third.
    for (std::size_t n = 0; n < 3; ++n)
        if (convex % 3 != 0 && with[n] == (convex == 1)) std::swap(sheets[0], sheets[n]);
}

double misfit_of(const std::vector<CreasePoint>& points, const auto& shape) {
    double squares = 0, weight = 0;
    for (const CreasePoint& p : points) {
        const double off = shape.distance(p.place);
        squares += p.weight * off * off;
        weight += p.weight;
    }
    return std::sqrt(squares / weight);
}

/// Fits a crease of `count` sheets; none if the normals of the points or of two sheets differ too little, if a sheet
/// has too few points, or if the misfit is too large.
/// @param misfit  misfit of the best fit so far: planes with a larger misfit are rejected
std::optional<Crease> fit_sheets(const std::vector<CreasePoint>& points, double radius, std::size_t count,
                                 double misfit) {
    Parts parts(points, radius);
    if (!divide(parts, count)) return {};
    Crease crease;
    crease.count = count;
    for (int turn = 0; turn < kTurns; ++turn) {
        for (std::size_t s = 0; s < count; ++s)
            if (!parts.plane(s, crease.sheets[s])) return {};
        if (turn == 1) {
            combine(parts, crease);
            if (misfit_of(points, crease) > misfit) return {};
        }
        if (!parts.assign(crease.sheets, count, [](const Sheet& plane, const Vec3& place) {
                return dot(minus(place, plane.origin), plane.axes[2]);
            }))
            break;
    }
    for (int turn = 0; turn < kRobustTurns; ++turn) {
        parts.reweight(crease.sheets);
        for (std::size_t s = 0; s < count; ++s)
            if (!parts.plane(s, crease.sheets[s])) return {};
    }
    combine(parts, crease);
    crease.misfit = misfit_of(points, crease);
    // Quadrics that are determined by few points are wrong beyond these points. Quadrics are therefore fitted only if
    // planes do not fit well, and used only if they fit clearly better.
    if (crease.misfit > kFlat * radius) {
        Crease bent = crease;  // All its sheets are fitted again because combine() may have swapped them.
        for (std::size_t n = 0; n < points.size(); ++n) parts.weights[n] = points[n].weight;
        for (int turn = 0; turn < kRobustTurns; ++turn) {
            for (std::size_t s = 0; s < count; ++s) {
                if (!parts.plane(s, bent.sheets[s])) return {};
                parts.bend(s, bent.sheets[s]);
            }
            parts.assign(bent.sheets, count,
                         [](const Sheet& sheet, const Vec3& place) { return sheet.distance(place); });
            parts.reweight(bent.sheets);
        }
        combine(parts, bent);
        bent.misfit = misfit_of(points, bent);
        if (bent.misfit < 0.75 * crease.misfit) crease = bent;
    }
    for (std::size_t s = 0; s < count; ++s)
        for (std::size_t o = 0; o < s; ++o)
            if (dot(crease.sheets[s].axes[2], crease.sheets[o].axes[2]) > kCloud.same_sheet) return {};
    return crease;
}

}  // namespace

std::optional<Crease> fit_crease(const std::vector<CreasePoint>& points, const Vec3& origin, double radius) {
    if (points.size() < 2 * kPlanePoints) return {};
    Vec3 normal{0, 0, 0};
    for (const CreasePoint& p : points) normal = plus(normal, p.weight, p.normal);
    if (!(length(normal) > 0)) return {};
    Sheet whole{origin, frame_of(unit(normal)), {}};
    const Parts all(points, radius);
    all.bend(Parts::kAll, whole);
    double misfit = misfit_of(points, whole);
    if (misfit < kFlat * radius) return {};
    std::optional<Crease> best;
    for (std::size_t count = 2; count <= 3; ++count) {
        std::optional<Crease> crease = fit_sheets(points, radius, count, misfit);
        if (!crease || !(kCommon.clear_ratio * crease->misfit < misfit)) continue;
        misfit = crease->misfit;
        best = std::move(crease);
        if (misfit < kFlat * radius) break;
    }
    if (best && best->misfit > kCrease.max_misfit * radius) return {};
    return best;
}

}  // namespace covol::cloud
