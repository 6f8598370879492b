#include "cloud/surface/local_fit.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "base/median.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/surface/crease.h"
#include "cloud/surface/fit_kernel.h"
#include "cloud/surface/heuristics.h"
#include "points/point_cells.h"

namespace covol::cloud {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct Fit {
    std::array<double, 6> c{};
    double noise = 0;  // standard deviation of the points from the quadric
    // Standard deviation of the thinned points from the quadric. Each is the mean of several points, in which noise
    // averages out, unlike an error of the quadric's shape.
    double misfit = 0;
    double deviation = 0;  // standard deviation of c[0]
    bool good = false;
};

/// The cloud, thinned for neighbourhoods of one radius.
struct Level {
    Level(const OrientedCloud& all, double r) : radius(r), cells(all.points, r) {
        sorted.reserve(all.size());
        for (const std::uint32_t n : cells.order()) {
            const Vec3 &p = all.points[n], &normal = all.normals[n];
            sorted.add({p[0], p[1], p[2]}, {normal[0], normal[1], normal[2]}, double(all.counts[n]));
            if (!all.squares_off.empty()) squares_off.push_back(all.squares_off[n]);
        }
        sorted.finish();
    }
    [[nodiscard]] Vec3 normal(std::uint32_t n) const {
        return {sorted.normal[0][n], sorted.normal[1][n], sorted.normal[2][n]};
    }
    double radius;
    PointCells cells;
    FitCloud sorted;                 // points in the order of the cells
    std::vector<float> squares_off;  // OrientedCloud::squares_off in the same order
};

struct Scratch {
    std::vector<PointCells::Range> ranges;
    FitPoints near;  // in units of the radius
    std::vector<CreasePoint> crease;
};

/// Copies to scratch.near the points of scratch.ranges that lie within level.radius of the origin and whose normals
/// point to the same side as axes[2].
void keep_near(const Level& level, const Vec3& origin, const std::array<Vec3, 3>& axes, Scratch& scratch) {
    std::size_t all = 0;
    for (const PointCells::Range& range : scratch.ranges) all += range.end - range.begin;
    scratch.near.clear(all);
    FitFrame frame{{origin[0], origin[1], origin[2]}, {}, level.radius};
    for (std::size_t a = 0; a < 3; ++a) std::copy(axes[a].begin(), axes[a].end(), frame.axes[a]);
    for (const PointCells::Range& range : scratch.ranges)
        select_near(level.sorted, range.begin, range.end, frame, scratch.near);
    scratch.near.fill_up();
}

Fit fit(const Level& level, const Vec3& origin, const std::array<Vec3, 3>& axes, Scratch& scratch) {
    const double r = level.radius;
    const FitPoints& near = scratch.near;
    keep_near(level, origin, axes, scratch);
    Fit result;
    if (near.size < kFit.min_points) return result;
    const FitSums sums = fit_sums(near);
    constexpr int kMoment[6][6] = {{0, 1, 2, 3, 4, 5},    {1, 3, 4, 6, 7, 8},    {2, 4, 5, 7, 8, 9},
                                   {3, 6, 7, 10, 11, 12}, {4, 7, 8, 11, 12, 13}, {5, 8, 9, 12, 13, 14}};
    Matrix6 m;
    for (int a = 0; a < 6; ++a)
        for (int b = 0; b < 6; ++b) m(a, b) = sums.moments[kMoment[a][b]];
    const Vector6 right = Eigen::Map<const Vector6>(sums.heights);
    const double sum = sums.moments[0];
    if (std::hypot(m(0, 1), m(0, 2)) > kFit.max_off_centre * sum) return result;
    // If the points lie near a line, as on narrow bodies, the quadric is undetermined across the line. Such points are
    // rejected.
    const double uu = m(1, 1) / sum - m(0, 1) * m(0, 1) / (sum * sum),
                 vv = m(2, 2) / sum - m(0, 2) * m(0, 2) / (sum * sum),
                 uv = m(1, 2) / sum - m(0, 1) * m(0, 2) / (sum * sum);
    if (0.5 * (uu + vv) - std::hypot(0.5 * (uu - vv), uv) < kFit.min_spread * kFit.min_spread) return result;
    for (int d = 3; d < 6; ++d) m(d, d) += kFit.ridge * sum;
    const Eigen::LDLT<Matrix6> solver(m);
    if (solver.info() != Eigen::Success || !solver.isPositive()) return result;
    const Vector6 x = solver.solve(right);
    const Vector6 first = solver.solve(Vector6::Unit(0));
    // Squares are weighted by counts because the variance of a mean of c points is 1 / c of the points' variance.
    const FitResidual residual = fit_residual(near, x.data());
    const double effective = sums.near * sums.near / sums.near_squares;
    if (effective < 7) return result;
    result.noise = r * std::sqrt(residual.squares / residual.near * effective / (effective - 6));
    result.misfit = r * std::sqrt(residual.squares / residual.weight * effective / (effective - 6));
    result.deviation = result.noise * std::sqrt(std::max(0.0, first[0]) * sums.squares / sum);
    result.c = {x[0] * r, x[1], x[2], x[3] / r, x[4] / r, x[5] / r};
    result.good = std::isfinite(x.sum());
    return result;
}

/// 1 if most points around `origin` on its sheet have normals on the side of `normal`, 0 if not; -1: too few points.
int is_of_majority(const Level& level, const Vec3& origin, const Vec3& normal,
                   const std::vector<PointCells::Range>& ranges) {
    const double r2 = level.radius * level.radius, height = kCloud.flat * level.radius;
    double same = 0, opposite = 0;
    for (const PointCells::Range& range : ranges)
        for (std::uint32_t n = range.begin; n < range.end; ++n) {
            const Vec3 to = minus(level.cells.sorted()[n], origin);
            if (dot(to, to) >= r2 || std::abs(dot(to, normal)) > height) continue;
            (dot(level.normal(n), normal) > 0 ? same : opposite) += level.sorted.count[n];
        }
    return same + opposite < kFit.min_majority ? -1 : same >= opposite;
}

/// Root mean square distance from the indicator's surface of the neighbourhood's points whose normals are on the side
/// of `normal`; infinite if the distances are unknown.
double off_indicator(const Level& level, const Vec3& origin, const Vec3& normal,
                     const std::vector<PointCells::Range>& ranges) {
    if (level.squares_off.empty()) return std::numeric_limits<double>::infinity();
    const double r2 = level.radius * level.radius;
    double squares = 0, weight = 0;
    for (const PointCells::Range& range : ranges)
        for (std::uint32_t n = range.begin; n < range.end; ++n) {
            const Vec3 to = minus(level.cells.sorted()[n], origin);
            const double near = 1 - dot(to, to) / r2;
            if (near <= 0 || dot(level.normal(n), normal) <= 0) continue;
            const double w = level.sorted.count[n] * near * near;
            squares += w * double(level.squares_off[n]);
            weight += w;
        }
    return std::sqrt(squares / weight);
}

Quadric choose(const std::vector<Level>& levels, const Vec3& point, const Vec3& normal, Scratch& scratch) {
    Quadric best;
    best.origin = point;
    best.axes = frame_of(normal);
    struct Seen {
        double height, deviation, misfit;
    };
    std::vector<Seen> seen;
    int majority = -1;
    for (const Level& level : levels) {
        level.cells.find(point, level.radius, scratch.ranges);
        if (majority < 0) {
            majority = is_of_majority(level, point, normal, scratch.ranges);
            best.min_radius = level.radius;
        }
        if (majority == 0) return best;
        if (seen.empty() && majority >= 0 && level.radius > kFit.max_growth * best.min_radius) return best;
        Fit now = fit(level, point, best.axes, scratch);
        if (!now.good || now.misfit > kFit.sheet_fraction * level.radius) {
            if (seen.empty()) continue;
            break;
        }
        if (seen.empty()) {
            // Fits again over the tangent plane of the first fit.
            Vec3 tilted;
            for (int a = 0; a < 3; ++a)
                tilted[a] = best.axes[2][a] - now.c[1] * best.axes[0][a] - now.c[2] * best.axes[1][a];
            const std::array<Vec3, 3> before = best.axes;
            best.axes = frame_of(unit(tilted));
            const Fit again = fit(level, point, best.axes, scratch);
            if (again.good)
                now = again;
            else
                best.axes = before;
        }
        const bool agrees = std::all_of(seen.begin(), seen.end(), [&](const Seen& s) {
            return std::abs(s.height - now.c[0]) <= kFit.agreement * s.deviation &&
                   now.misfit <= kFit.misfit_growth * s.misfit;
        });
        if (!agrees) break;
        if (seen.empty() &&
            (std::abs(now.c[0]) > kFit.max_height * level.radius || dot(best.axes[2], normal) < kCommon.turn))
            return best;
        if (seen.empty() && now.misfit > kFit.off_indicator * off_indicator(level, point, best.axes[2], scratch.ranges))
            return best;
        if (seen.empty()) best.noise = now.noise;  // in wider neighbourhoods, the quadric's error adds to the noise
        seen.push_back({now.c[0], now.deviation, now.misfit});
        best.c = now.c;
        best.radius = level.radius;
    }
    // Noise along a curved surface displaces points to positions where the surface is lower or higher. This changes
    // their mean height by half the variance times the surface's Laplacian.
    best.c[0] -= best.noise * best.noise * (best.c[3] + best.c[5]);
    return best;
}

/// The sheets that meet near `place`; none if one quadric fits the points almost as well: fit_crease(). Points whose
/// normals differ from `normal` by 120 degrees or more are left out, because they are on the other side of a thin body.
std::optional<Crease> crease_at(const Level& level, const Vec3& place, const Vec3& normal, Scratch& scratch) {
    level.cells.find(place, level.radius, scratch.ranges);
    std::vector<CreasePoint>& points = scratch.crease;
    points.clear();
    const double r2 = level.radius * level.radius;
    for (const PointCells::Range& range : scratch.ranges)
        for (std::uint32_t n = range.begin; n < range.end; ++n) {
            const Vec3 to = minus(level.cells.sorted()[n], place);
            const double near = 1 - dot(to, to) / r2;
            if (near > 0 && dot(level.normal(n), normal) > -kCommon.turn)
                points.push_back({level.cells.sorted()[n], level.normal(n), level.sorted.count[n] * near * near});
        }
    return fit_crease(points, place, level.radius);
}

/// Replaces a quadric by a crease, if there is one, unless the quadric's neighbourhood is wider than the crease's.
void take_crease(const Level& level, const Vec3& normal, Quadric& q, Scratch& scratch) {
    if (q.radius > level.radius) return;
    const std::optional<Crease> crease = crease_at(level, q.origin, normal, scratch);
    if (!crease) return;
    const std::array<Vec3, 3> axes = frame_of(crease->mean_normal());
    // Newton's method for the height at which the line along the mean normal meets the sheets.
    double height = 0;
    for (int step = 0; step < 4; ++step) {
        const Vec3 at = plus(q.origin, height, axes[2]);
        const Sheet& sheet = crease->sheets[crease->nearest(at)];
        const double along = dot(sheet.normal(at), axes[2]);
        if (!(along > 0.1)) return;
        height -= sheet.distance(at) / along;
    }
    if (!(std::abs(height) < level.radius)) return;
    q.axes = axes;
    q.c = {height, 0, 0, 0, 0, 0};
    q.radius = level.radius;
    q.noise = crease->misfit;
    q.crease = std::make_shared<const Crease>(*crease);
}

/// Radius of the neighbourhoods in which creases are sought. It is so wide that the noise, as a fraction of the radius,
/// is below the maximum misfit of the sheets, but at most twice the usual radius, so that other creases are not
/// included. 0 if no radius satisfies both.
double crease_radius_for(double spacing, double noise) {
    const double smallest = kCrease.radius * spacing, widest = 2 * smallest;
    if (noise > kCrease.max_misfit * widest) return 0;
    return std::clamp(noise / (0.75 * kCrease.max_misfit), smallest, widest);
}

/// Fits quadrics to the cloud, which is thinned for each radius.
class Fitter {
public:
    Fitter(const OrientedCloud& cloud, double spacing, double noise, const RunContext& run) {
        if (const double wide = crease_radius_for(spacing, noise); wide > 0) every_.emplace(cloud, wide);
        levels_.reserve(kFit.levels);
        OrientedCloud last;
        double radius = kFit.first_spacings * spacing;
        for (int n = 0; n < kFit.levels; ++n, radius *= kCommon.growth) {
            run.check();
            // Averages of the last level's averages are fast to compute and precise enough for this radius.
            last = thinned(n == 0 ? cloud : last, kFit.thinned_fraction * radius);
            levels_.emplace_back(last, radius);
        }
    }

    /// Radius of the neighbourhoods in which creases are sought; 0: none.
    [[nodiscard]] double crease_radius() const { return every_ ? every_->radius : 0; }

    [[nodiscard]] std::vector<Quadric> fit(const OrientedCloud& nodes, bool with_creases, const RunContext& run) const {
        std::vector<Quadric> result(nodes.size());
        tbb::enumerable_thread_specific<Scratch> scratch;
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodes.size(), 256), [&](const auto& range) {
            if (run.cancelled()) return;
            Scratch& mine = scratch.local();
            for (std::size_t n = range.begin(); n < range.end(); ++n) {
                result[n] = choose(levels_, nodes.points[n], nodes.normals[n], mine);
                if (with_creases) take_crease(*every_, nodes.normals[n], result[n], mine);
            }
        });
        run.check();
        return result;
    }

private:
    std::vector<Level> levels_;
    std::optional<Level> every_;  // all points: thinning would average across creases
};

/// The nodes that are not yet represented by a nearby quadric on the same sheet.
OrientedCloud without_covered(const OrientedCloud& nodes, const std::vector<Quadric>& quadrics) {
    std::vector<Vec3> feet;
    double reach = 0;
    for (const Quadric& q : quadrics) {
        feet.push_back(q.foot());
        reach = std::max(reach, q.apart);
    }
    const PointCells cells(feet, reach);
    std::vector<char> covered(nodes.size(), 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodes.size(), 256), [&](const auto& part) {
        std::vector<PointCells::Range> ranges;
        for (std::size_t n = part.begin(); n < part.end(); ++n) {
            const Vec3& p = nodes.points[n];
            cells.find(p, reach, ranges);
            for (const PointCells::Range& range : ranges)
                for (std::uint32_t at = range.begin; at < range.end && !covered[n]; ++at) {
                    const Quadric& q = quadrics[cells.order()[at]];
                    const Vec3 to = minus(p, cells.sorted()[at]);
                    covered[n] = dot(to, to) < q.apart * q.apart &&
                                 dot(nodes.normals[n], q.axes[2]) > (q.crease ? 0 : kCommon.turn);
                }
        }
    });
    OrientedCloud left;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        if (covered[n]) continue;
        left.points.push_back(nodes.points[n]);
        left.normals.push_back(nodes.normals[n]);
        left.counts.push_back(nodes.counts[n]);
    }
    return left;
}

/// Removes quadrics that are fitted to a few sparse points near quadrics of much denser points: the neighbourhoods of
/// the former are so wide that they may contain points of another side of the body.
std::vector<Quadric> without_lone(const std::vector<Quadric>& quadrics) {
    if (quadrics.empty()) return {};
    std::vector<Vec3> feet;
    std::vector<double> minimum;
    for (const Quadric& q : quadrics) {
        feet.push_back(q.foot());
        minimum.push_back(q.min_radius);
    }
    const double usual = median(minimum);
    const PointCells cells(feet, 2 * usual);
    std::vector<char> lone(quadrics.size(), 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, quadrics.size(), 256), [&](const auto& part) {
        std::vector<PointCells::Range> ranges;
        for (std::size_t n = part.begin(); n < part.end(); ++n) {
            const double r = minimum[n];
            if (r <= kCommon.clear_ratio * usual) continue;
            const Vec3& p = feet[n];
            cells.find(p, r, ranges);
            for (const PointCells::Range& range : ranges)
                for (std::uint32_t at = range.begin; at < range.end && !lone[n]; ++at) {
                    const Vec3 to = minus(cells.sorted()[at], p);
                    lone[n] = dot(to, to) < r * r && kCommon.clear_ratio * minimum[cells.order()[at]] < r;
                }
        }
    });
    std::vector<Quadric> left;
    for (std::size_t n = 0; n < quadrics.size(); ++n)
        if (!lone[n]) left.push_back(quadrics[n]);
    return left;
}

}  // namespace

OrientedCloud thinned(const OrientedCloud& cloud, double edge) {
    const PointCells cells(cloud.points, edge);
    const bool is_off_known = !cloud.squares_off.empty();
    struct Mean {
        Vec3 point{0, 0, 0}, normal{0, 0, 0};
        double count = 0, squares_off = 0;
    };
    const auto add_cell = [&](std::size_t n, OrientedCloud& result) {
        std::array<Mean, 6> means;  // indexed by the signed axis closest to the normal
        const auto [begin, end] = cells.cell(n);
        for (std::uint32_t at = begin; at < end; ++at) {
            const std::uint32_t point = cells.order()[at];
            const Vec3& normal = cloud.normals[point];
            int axis = 0;
            for (int a = 1; a < 3; ++a)
                if (std::abs(normal[a]) > std::abs(normal[axis])) axis = a;
            Mean& mean = means[std::size_t(2 * axis + (normal[axis] < 0))];
            const double c = double(cloud.counts[point]);
            for (int a = 0; a < 3; ++a) {
                mean.point[a] += c * cloud.points[point][a];
                mean.normal[a] += c * normal[a];
            }
            mean.count += c;
            if (is_off_known) mean.squares_off += c * double(cloud.squares_off[point]);
        }
        // Means whose normals differ by less than 90 degrees belong to one side of a sheet and are merged.
        for (std::size_t m = 0; m < 6; ++m)
            for (std::size_t o = 0; o < m; ++o)
                if (means[m].count > 0 && means[o].count > 0 && dot(means[m].normal, means[o].normal) > 0) {
                    for (int a = 0; a < 3; ++a) {
                        means[m].point[a] += means[o].point[a];
                        means[m].normal[a] += means[o].normal[a];
                    }
                    means[m].count += means[o].count;
                    means[m].squares_off += means[o].squares_off;
                    means[o] = {};
                }
        for (const Mean& mean : means) {
            if (!(mean.count > 0) || !(dot(mean.normal, mean.normal) > 0)) continue;
            result.points.push_back(
                {mean.point[0] / mean.count, mean.point[1] / mean.count, mean.point[2] / mean.count});
            result.normals.push_back(unit(mean.normal));
            result.counts.push_back(float(mean.count));
            if (is_off_known) result.squares_off.push_back(float(mean.squares_off / mean.count));
        }
    };
    constexpr std::size_t kCells = 4096;
    std::vector<OrientedCloud> parts((cells.cell_count() + kCells - 1) / kCells);
    tbb::parallel_for(std::size_t(0), parts.size(), [&](std::size_t part) {
        for (std::size_t n = part * kCells; n < std::min(cells.cell_count(), (part + 1) * kCells); ++n)
            add_cell(n, parts[part]);
    });
    OrientedCloud result;
    for (const OrientedCloud& part : parts) {
        result.points.insert(result.points.end(), part.points.begin(), part.points.end());
        result.normals.insert(result.normals.end(), part.normals.begin(), part.normals.end());
        result.counts.insert(result.counts.end(), part.counts.begin(), part.counts.end());
        result.squares_off.insert(result.squares_off.end(), part.squares_off.begin(), part.squares_off.end());
    }
    return result;
}

std::vector<Quadric> fit_quadrics(const OrientedCloud& nodes, const OrientedCloud& cloud, double spacing,
                                  const RunContext& run) {
    return Fitter(cloud, spacing, 0, run).fit(nodes, true, run);
}

std::vector<Quadric> quadrics_over(const OrientedCloud& places, const OrientedCloud& cloud, double edge, double spacing,
                                   double noise, std::size_t& bare, const RunContext& run) {
    const Fitter fitter(cloud, spacing, noise, run);
    std::vector<Quadric> all;
    bare = 0;
    for (double times = kFit.widest;; times = std::max(1.0, times / 2)) {
        const double apart = times * edge;
        OrientedCloud nodes = thinned(places, apart);
        if (!all.empty()) nodes = without_covered(nodes, all);
        const bool is_last = !(times > 1);
        const double minimum = is_last ? 0 : kFit.wide_of_apart * apart;
        std::vector<Quadric> found = fitter.fit(nodes, fitter.crease_radius() > minimum, run);
        bare = std::size_t(std::count_if(found.begin(), found.end(), [](const Quadric& q) { return !(q.radius > 0); }));
        for (Quadric& q : found) {
            if (!(q.radius > minimum)) continue;
            q.apart = apart;
            all.push_back(q);
        }
        if (is_last) return without_lone(all);
    }
}

}  // namespace covol::cloud
