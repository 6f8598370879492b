#include "guess/marks_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "guess/heuristics.h"
#include "guess/wendland.h"
#include "points/kd_tree.h"

namespace covol::guess {
namespace {

// Fraction of the stated variance below which marks count as exact, so that no smaller variance is tried: the standard
// deviation is then about 1/30 of the stated one.
constexpr double kExact = 1e-3;
// Weight of the whole (the surface through a spread-out subset of the marks), relative to that of a patch at its
// centre. It is small, because the whole only has to continue the patches where their weights decrease to 0.
constexpr double kWholeWeight = 1e-3;

/// Number of marks whose normals are optimised first, from several initial directions. The time grows with the cube of
/// the number, so that several attempts with a third of kMarks.whole marks take less time than one with all.
std::size_t oriented_marks() { return kMarks.whole / 3; }

/// Number of marks in a patch. A fourth of them, those nearest to its centre, are its core: as many as a quadric is
/// fitted to. On a surface the core extends to about half of the patch's radius. Each mark is in the core of some
/// patch.
std::size_t part_marks() { return 4 * kCommon.quadric; }

/// Ratio between the variances of the marks that are tried one after the other: 4, so that the standard deviation
/// changes by a factor of 2.
double variance_step() { return std::pow(kCommon.growth, 4); }

Vec3 unit_or_x(const Vec3& v) {
    const double size = length(v);
    return size > 0 ? Vec3{v[0] / size, v[1] / size, v[2] / size} : Vec3{1, 0, 0};
}

/// The constraints of the selected marks, with the variance along their normals if these are known.
Constraints part_of(const ImpreciseMarks& all, const std::vector<std::size_t>& chosen, const Normals& normals) {
    Constraints part;
    const double mean_variance = (dot(all.deviation[0], all.deviation[0]) + dot(all.deviation[1], all.deviation[1]) +
                                  dot(all.deviation[2], all.deviation[2])) /
                                 3;
    for (const std::size_t n : chosen) {
        part.marks.push_back(all.marks[n]);
        part.variance.push_back(normals.empty() ? mean_variance : all.variance_along(normals[n]));
    }
    return part;
}

std::vector<Vec3> at(const std::vector<Vec3>& all, const std::vector<std::size_t>& chosen) {
    std::vector<Vec3> some;
    for (const std::size_t n : chosen) some.push_back(all[n]);
    return some;
}

std::vector<Vec3> normals_of(const VariationalSurface& surface, const std::vector<Vec3>& marks) {
    std::vector<Vec3> normals(marks.size());
    tbb::parallel_for(std::size_t(0), marks.size(),
                      [&](std::size_t n) { normals[n] = unit_or_x(surface.gradient(marks[n])); });
    return normals;
}

double mean_value(const VariationalSurface& surface, const Constraints& part) {
    double sum = 0, weights = 0;
    for (std::size_t n = 0; n < part.marks.size(); ++n) {
        const double weight = 1 / std::max(part.variance[n], 1e-300);
        sum += weight * surface.value(part.marks[n]);
        weights += weight;
    }
    return weights > 0 ? sum / weights : 0.0;
}

/// Indices of the `count` points nearest to the point with the index `to`, sorted by distance; the first is `to`
/// itself.
std::vector<std::size_t> nearest(const std::vector<Vec3>& points, std::size_t to, std::size_t count) {
    std::vector<std::pair<double, std::size_t>> by_distance(points.size());
    for (std::size_t n = 0; n < points.size(); ++n)
        by_distance[n] = {detail::squared_distance(points[n], points[to]), n};
    count = std::min(count, points.size());
    std::partial_sort(by_distance.begin(), by_distance.begin() + std::ptrdiff_t(count), by_distance.end());
    std::vector<std::size_t> chosen(count);
    for (std::size_t n = 0; n < count; ++n) chosen[n] = by_distance[n].second;
    return chosen;
}

/// The most probable fraction of the stated variance, for marks that fit each other better than stated.
struct LikeliestVariance {
    double factor = 1;
    std::unique_ptr<VariationalSurface> surface;  ///< computed with that variance
};

/// The gain in log likelihood that is required to change the variance. For exact marks, a variance that is
/// variance_step() times smaller increases the likelihood of each by a factor of sqrt(variance_step()); a step requires
/// half of that gain.
double step_shows(double marks) { return 0.5 * 0.5 * marks * std::log(variance_step()); }

LikeliestVariance likeliest_variance(const VariationalSurface& stated, const ImpreciseMarks& marks,
                                     const std::vector<std::size_t>& chosen,
                                     const std::function<Constraints(Constraints)>& complete, const RunContext& run) {
    const std::vector<Vec3> normals = normals_of(stated, marks.marks);
    const auto with = [&](double factor) {
        Constraints part = complete(part_of(marks, chosen, normals));
        for (double& v : part.variance) v *= factor;
        return std::make_unique<VariationalSurface>(part, at(normals, chosen), Search::Near);
    };
    const double enough = step_shows(double(chosen.size()));
    LikeliestVariance best{1, with(1)};
    while (best.factor > kExact) {
        run.check();
        std::unique_ptr<VariationalSurface> finer = with(best.factor / variance_step());
        if (finer->log_likelihood() - best.surface->log_likelihood() < enough) break;
        best = {best.factor / variance_step(), std::move(finer)};
    }
    return best;
}

/// The most probable factor of the stated variance, at least 1, for marks that fit each other worse than stated. It is
/// computed on neighbourhoods, in which the marks are dense enough to distinguish imprecise marks from a rough surface.
double likeliest_coarser_factor(const ImpreciseMarks& marks, const Normals& normals, const RunContext& run) {
    // All neighbourhoods together have about kMarks.whole marks, so that the relative standard error of the variance is
    // below a tenth.
    const std::vector<std::size_t> centers = spread_out(marks.marks, 1 + kMarks.whole / part_marks());
    std::vector<std::vector<std::size_t>> near;
    for (const std::size_t center : centers) near.push_back(nearest(marks.marks, center, part_marks()));
    const auto log_likelihood = [&](double factor) {
        run.check();
        std::vector<double> of_part(near.size());
        tbb::parallel_for(std::size_t(0), near.size(), [&](std::size_t n) {
            Constraints part = part_of(marks, near[n], normals);
            for (double& v : part.variance) v *= factor;
            of_part[n] = VariationalSurface(part, at(normals, near[n]), Search::Near).log_likelihood();
        });
        return std::accumulate(of_part.begin(), of_part.end(), 0.0);
    };
    const double enough = step_shows(double(near.size() * near.front().size()));
    double factor = 1, best = log_likelihood(1);
    while (factor < marks.max_factor) {
        const double coarser = std::min(factor * variance_step(), marks.max_factor);
        const double likelihood = log_likelihood(coarser);
        if (likelihood - best < enough) break;
        factor = coarser;
        best = likelihood;
    }
    return factor;
}

}  // namespace

std::vector<std::size_t> spread_out(const std::vector<Vec3>& points, std::size_t count, std::size_t first) {
    std::vector<std::size_t> chosen;
    std::vector<double> away(points.size(), std::numeric_limits<double>::infinity());
    std::size_t next = first;
    while (chosen.size() < std::min(count, points.size())) {
        chosen.push_back(next);
        for (std::size_t n = 0; n < points.size(); ++n)
            away[n] = std::min(away[n], detail::squared_distance(points[n], points[next]));
        next = std::size_t(std::max_element(away.begin(), away.end()) - away.begin());
        if (!(away[next] > 0)) break;  // the remaining points are duplicates
    }
    return chosen;
}

double ImpreciseMarks::variance_along(const Vec3& n) const {
    double sum = 0;
    for (const Vec3& axis : deviation) sum += dot(axis, n) * dot(axis, n);
    return sum;
}

MarksSurface::MarksSurface(const ImpreciseMarks& marks, const RunContext& run) {
    const auto with_seeds = [&](Constraints part) {
        part.seeds = marks.seeds;
        part.seed_value = marks.seed_value;
        part.world = marks.world;
        return part;
    };
    const std::vector<std::size_t> few = spread_out(marks.marks, oriented_marks());
    // If approximate normals are given, other directions are not tried.
    const bool is_known = !marks.normals.empty();
    const Search search = is_known ? Search::Near : Search::Wide;
    const VariationalSurface first(with_seeds(part_of(marks, few, marks.normals)),
                                   is_known ? at(marks.normals, few) : Normals{}, search);
    const LikeliestVariance likeliest = likeliest_variance(first, marks, few, with_seeds, run);
    const VariationalSurface& oriented = *likeliest.surface;
    variance_factor_ = likeliest.factor;
    const std::vector<std::size_t> many = spread_out(marks.marks, kMarks.whole);
    const auto make_whole = [&](const Normals& normals, double amplitude) {
        const Constraints part = with_factor(with_seeds(part_of(marks, many, normals)));
        whole_ = std::make_unique<VariationalSurface>(part, at(normals, many), search, amplitude);
        offset_ = mean_value(*whole_, part);
        run.check();
    };
    make_whole(is_known ? marks.normals : normals_of(oriented, marks.marks), oriented.amplitude());
    if (marks.max_factor > 1 && variance_factor_ == 1) {
        const Normals normals = normals_of(*whole_, marks.marks);
        variance_factor_ = likeliest_coarser_factor(marks, normals, run);
        if (variance_factor_ > 1) make_whole(normals, 0);
    }
    if (marks.marks.size() > kMarks.whole) make_patches(marks, run);
}

void MarksSurface::make_patches(const ImpreciseMarks& marks, const RunContext& run) {
    const std::vector<Vec3> normals = marks.normals.empty() ? normals_of(*whole_, marks.marks) : marks.normals;
    const std::size_t count = marks.marks.size();
    std::vector<char> covered(count, 0);
    struct Neighbourhood {
        std::size_t center;
        std::vector<std::size_t> marks;
        double radius;
    };
    std::vector<Neighbourhood> places;
    for (std::size_t n = 0; n < count; ++n) {
        if (covered[n]) continue;
        std::vector<std::size_t> near = nearest(marks.marks, n, part_marks());
        for (std::size_t k = 0; k < std::min(kCommon.quadric, near.size()); ++k) covered[near[k]] = 1;
        const double reach = std::sqrt(detail::squared_distance(marks.marks[near.back()], marks.marks[n]));
        places.push_back({n, std::move(near), reach});
    }
    run.check();
    std::vector<std::unique_ptr<Patch>> made(places.size());
    tbb::parallel_for(std::size_t(0), places.size(), [&](std::size_t p) {
        if (run.cancelled()) return;
        Constraints part = with_factor(part_of(marks, places[p].marks, normals));
        for (const Vec3& mark : part.marks) {
            part.known_value.push_back(whole_->value(mark) - offset_);
            part.known_gradient.push_back(whole_->gradient(mark));
        }
        made[p] = std::make_unique<Patch>(
            Patch{marks.marks[places[p].center], places[p].radius,
                  VariationalSurface(part, at(normals, places[p].marks), Search::Near, whole_->amplitude())});
    });
    run.check();
    for (auto& patch : made) patches_.push_back(std::move(*patch));
    sort_patches();
}

void MarksSurface::sort_patches() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    low_ = {kInfinity, kInfinity, kInfinity};
    Vec3 high{-kInfinity, -kInfinity, -kInfinity};
    double radii = 0;
    for (const Patch& p : patches_) {
        radii += p.radius / double(patches_.size());
        for (int a = 0; a < 3; ++a) {
            low_[a] = std::min(low_[a], p.center[a] - p.radius);
            high[a] = std::max(high[a], p.center[a] + p.radius);
        }
    }
    cell_ = radii;
    for (int a = 0; a < 3; ++a) {
        constexpr double kMaxCells = 128;
        cell_ = std::max(cell_, (high[a] - low_[a]) / kMaxCells);
    }
    for (int a = 0; a < 3; ++a) cells_[a] = 1 + int((high[a] - low_[a]) / cell_);
    in_cell_.assign(std::size_t(cells_[0]) * cells_[1] * cells_[2], {});
    for (std::size_t n = 0; n < patches_.size(); ++n) {
        const Patch& p = patches_[n];
        int lo[3], hi[3];
        for (int a = 0; a < 3; ++a) {
            lo[a] = std::clamp(int((p.center[a] - p.radius - low_[a]) / cell_), 0, cells_[a] - 1);
            hi[a] = std::clamp(int((p.center[a] + p.radius - low_[a]) / cell_), 0, cells_[a] - 1);
        }
        for (int i = lo[0]; i <= hi[0]; ++i)
            for (int j = lo[1]; j <= hi[1]; ++j)
                for (int k = lo[2]; k <= hi[2]; ++k)
                    in_cell_[(std::size_t(i) * cells_[1] + j) * cells_[2] + k].push_back(std::uint32_t(n));
    }
}

Constraints MarksSurface::with_factor(Constraints part) const {
    for (double& v : part.variance) v *= variance_factor_;
    return part;
}

double MarksSurface::value(const Vec3& at) const {
    double result = 0;
    row(at, {0, 0, 0}, 1, &result);
    return result;
}

void MarksSurface::row(const Vec3& from, const Vec3& step, int count, double* values) const {
    whole_->row(from, step, count, values);
    for (int n = 0; n < count; ++n) values[n] -= offset_;
    if (patches_.empty()) return;
    std::vector<double> added(count, 0.0), weights(std::size_t(count), kWholeWeight), part(count), w(count);
    // The patches of all cells that the row crosses, sorted by number, so that the rounding of the sum does not depend
    // on how rows are split.
    std::vector<std::uint32_t> met;
    std::size_t last = std::numeric_limits<std::size_t>::max();
    for (int n = 0; n < count; ++n) {
        int c[3];
        bool inside = true;
        for (int a = 0; a < 3; ++a) {
            c[a] = int(std::floor((from[a] + n * step[a] - low_[a]) / cell_));
            inside = inside && c[a] >= 0 && c[a] < cells_[a];
        }
        if (!inside) continue;
        const std::size_t cell = (std::size_t(c[0]) * cells_[1] + c[1]) * cells_[2] + c[2];
        if (cell == last) continue;
        last = cell;
        met.insert(met.end(), in_cell_[cell].begin(), in_cell_[cell].end());
    }
    std::sort(met.begin(), met.end());
    met.erase(std::unique(met.begin(), met.end()), met.end());
    for (const std::uint32_t id : met) {
        const Patch& patch = patches_[id];
        int first = count, end = 0;
        for (int n = 0; n < count; ++n) {
            const Vec3 at{from[0] + n * step[0], from[1] + n * step[1], from[2] + n * step[2]};
            w[n] = detail::wendland(std::sqrt(detail::squared_distance(at, patch.center)) / patch.radius);
            if (w[n] > 0) first = std::min(first, n), end = n + 1;
        }
        if (first >= end) continue;
        const Vec3 begin{from[0] + first * step[0], from[1] + first * step[1], from[2] + first * step[2]};
        patch.added.row(begin, step, end - first, part.data());
        for (int n = first; n < end; ++n) {
            added[n] += w[n] * part[n - first];
            weights[n] += w[n];
        }
    }
    for (int n = 0; n < count; ++n) values[n] += added[n] / weights[n];
}

}  // namespace covol::guess
