#include "covol/orientation.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <tuple>

#include "base/geometry.h"
#include "cloud/orientation/areas.h"
#include "cloud/orientation/given_sides.h"
#include "cloud/orientation/heuristics.h"
#include "cloud/orientation/indicator.h"
#include "cloud/orientation/stray.h"
#include "cloud/orientation/torn.h"
#include "cloud/orientation/views.h"
#include "covol/error.h"
#include "covol/points.h"
#include "points/point_cells.h"

namespace covol {
namespace {

using cloud::PointCells;
using cloud::StackField;
using cloud::WindingField;

/// What is tried until few normals turn.
struct Try {
    double cell;      // of those
    double enclosed;  // on the first lattice
    double first_guess = kOrientation.first_cells;
};
const Try kTries[] = {{1, kOrientation.enclosed},
                      {1, kOrientation.surely_enclosed},
                      {1, kOrientation.enclosed, kOrientation.finer_first_cells},
                      {0.67, kOrientation.surely_enclosed},
                      {1.5, kOrientation.surely_enclosed, kOrientation.finer_first_cells},
                      {0.44, kOrientation.enclosed},
                      {2.25, kOrientation.surely_enclosed}};

/// A stack of grids and what is done on it.
struct Stage {
    double cell;     // of the finest
    int iterations;  // at most
    bool is_last;
    double enclosed;  // the indicator from which on a point counts as enclosed by another part
};

class Iteration {
public:
    /// @param first_guess  [cells of the first stage] of the grid of the density that gives the first normals
    Iteration(const std::vector<Vec3>& points, const std::vector<double>& areas, double first_guess,
              const RunContext& run)
        : points_(points), areas_(areas), first_guess_(first_guess), run_(run) {}

    void run(const Stage& stage, Orientation& result) {
        WindingField field(cloud::indicator_grid(points_, areas_, stage.cell));
        if (last_) field.start_from(last_->indicator());
        stage_ = stage;
        if (result.normals.empty()) guess_normals(stage.cell, result);
        for (int n = 0; n < stage.iterations; ++n) {
            ++result.iterations;
            if (turn(field, result, kOrientation.cycles) < kOrientation.steady) break;
        }
        turn_patches(field, result);
        if (stage.is_last) turn(field, result, kOrientation.last_cycles);
        last_.emplace(std::move(field));
    }

    /// @param spacing  of the points
    void mend(double spacing, Orientation& result) {
        result.mended = cloud::mend_torn(points_, spacing, result.normals);
        if (result.mended > 0) solve(*last_, result, kOrientation.last_cycles);
    }

    [[nodiscard]] WindingField& last() { return *last_; }

private:
    void guess_normals(double cell, Orientation& result) const {
        const StackField density = cloud::spread(cloud::grid_around(points_, areas_, first_guess_ * cell), points_,
                                                 std::vector<double>(points_.size(), 1.0));
        result.normals.resize(points_.size());
        tbb::parallel_for(std::size_t(0), points_.size(), [&](std::size_t n) {
            const Vec3 g = density.at(points_[n]).gradient;
            result.normals[n] = unit({-g[0], -g[1], -g[2]});
        });
    }

    /// The indicator of the normals.
    void solve(WindingField& field, Orientation& result, int cycles) {
        cloud::solve(field, points_, result, cycles, run_);
        const double half = cloud::scale_to_half(field, points_);
        for (double& area : result.areas) area *= half;
    }

    /// @return the normals' mean change, 1 - cosine
    double turn(WindingField& field, Orientation& result, int cycles) {
        solve(field, result, cycles);
        const std::size_t count = points_.size();
        const StackField& chi = field.indicator();
        std::vector<double> cosine(count);
        tbb::parallel_for(std::size_t(0), count, [&](std::size_t n) {
            const StackField::Sample here = chi.at(points_[n]);
            const double sign = here.value < 0 || here.value > stage_.enclosed ? 1 : -1;
            const Vec3 normal = unit({sign * here.gradient[0], sign * here.gradient[1], sign * here.gradient[2]});
            cosine[n] = dot(normal, result.normals[n]);
            if (dot(normal, normal) > 0) result.normals[n] = normal;
        });
        result.turned =
            double(std::count_if(cosine.begin(), cosine.end(), [](double c) { return c < 0; })) / double(count);
        return 1 - std::accumulate(cosine.begin(), cosine.end(), 0.0) / double(count);
    }

    /// Where the indicator is not 1/2 on the mean over a patch, the patch may be turned as a whole, and stay so: it
    /// makes its own normals. Each such patch is turned to try, all at once, and stays turned where that brings it
    /// closer to 1/2.
    void turn_patches(WindingField& field, Orientation& result) {
        const PointCells cells(points_, kOrientation.patch_cells * field.indicator().stack().cell());
        const std::vector<std::vector<std::uint32_t>> beside = neighbours_of(cells);
        for (int round = 0; round < kOrientation.patch_rounds; ++round) {
            turn(field, result, kOrientation.patch_cycles);  // the indicator of what the normals are now
            const std::vector<double> off = mean_off(cells, field.indicator());
            const std::vector<int> patch = patches_of(cells, beside, off);
            const int patches = 1 + *std::max_element(patch.begin(), patch.end());
            if (patches == 0) return;
            const std::vector<Vec3> before = result.normals;
            for_points_of(cells, [&](std::size_t cell, std::uint32_t point) {
                if (patch[cell] >= 0)
                    for (double& c : result.normals[point]) c = -c;
            });
            solve(field, result, kOrientation.patch_cycles);
            const std::vector<double> turned = mean_off(cells, field.indicator());
            std::vector<double> gain(std::size_t(patches), 0.0);
            for (std::size_t cell = 0; cell < patch.size(); ++cell) {
                if (patch[cell] < 0) continue;
                const auto [begin, end] = cells.cell(cell);
                gain[std::size_t(patch[cell])] +=
                    double(end - begin) * (off[cell] * off[cell] - turned[cell] * turned[cell]);
            }
            double stayed = 0;
            for_points_of(cells, [&](std::size_t cell, std::uint32_t point) {
                if (patch[cell] < 0) return;
                if (gain[std::size_t(patch[cell])] > 0)
                    ++stayed;
                else
                    result.normals[point] = before[point];
            });
            for (int n = 0; n < kOrientation.after_turning; ++n) turn(field, result, kOrientation.patch_cycles);
            if (stayed < kOrientation.few_stayed * double(points_.size())) return;
        }
    }

    template <typename Visit>
    static void for_points_of(const PointCells& cells, Visit visit) {
        for (std::size_t cell = 0; cell < cells.cell_count(); ++cell)
            for (std::uint32_t at = cells.cell(cell).begin; at < cells.cell(cell).end; ++at)
                visit(cell, cells.order()[at]);
    }

    static std::vector<std::vector<std::uint32_t>> neighbours_of(const PointCells& cells) {
        std::vector<std::uint32_t> cell_of(cells.sorted().size());
        for (std::uint32_t cell = 0; cell < cells.cell_count(); ++cell)
            for (std::uint32_t at = cells.cell(cell).begin; at < cells.cell(cell).end; ++at) cell_of[at] = cell;
        std::vector<std::vector<std::uint32_t>> beside(cells.cell_count());
        std::vector<PointCells::Range> ranges;
        for (std::uint32_t cell = 0; cell < cells.cell_count(); ++cell) {
            cells.find(cells.sorted()[cells.cell(cell).begin], cells.edge(), ranges);
            for (const PointCells::Range& range : ranges)
                for (std::uint32_t at = range.begin; at < range.end; at = cells.cell(cell_of[at]).end)
                    if (cell_of[at] != cell) beside[cell].push_back(cell_of[at]);
        }
        return beside;
    }

    /// Mean over each cell's points of the indicator, less 1/2.
    static std::vector<double> mean_off(const PointCells& cells, const StackField& chi) {
        std::vector<double> off(cells.cell_count());
        tbb::parallel_for(std::size_t(0), off.size(), [&](std::size_t cell) {
            const auto [begin, end] = cells.cell(cell);
            double sum = 0;
            for (std::uint32_t at = begin; at < end; ++at) sum += chi.value_at(cells.sorted()[at]) - 0.5;
            off[cell] = sum / double(end - begin);
        });
        return off;
    }

    /// Connected cells that are off to the same side; -1: not off.
    static std::vector<int> patches_of(const PointCells& cells, const std::vector<std::vector<std::uint32_t>>& beside,
                                       const std::vector<double>& off) {
        std::vector<int> patch(cells.cell_count(), -1);
        const auto side = [&](std::size_t cell) {
            return std::abs(off[cell]) < kOrientation.patch_off ? 0 : off[cell] < 0 ? -1 : 1;
        };
        int count = 0;
        std::vector<std::uint32_t> front;
        for (std::uint32_t first = 0; first < patch.size(); ++first) {
            if (patch[first] >= 0 || side(first) == 0) continue;
            patch[first] = count;
            front.push_back(first);
            while (!front.empty()) {
                const std::uint32_t cell = front.back();
                front.pop_back();
                for (const std::uint32_t next : beside[cell])
                    if (patch[next] < 0 && side(next) == side(first)) {
                        patch[next] = count;
                        front.push_back(next);
                    }
            }
            ++count;
        }
        return patch;
    }

    const std::vector<Vec3>& points_;
    const std::vector<double>& areas_;  // before the indicator's step scales them
    double first_guess_;
    const RunContext& run_;
    Stage stage_{};
    std::optional<WindingField> last_;
};

/// Outward, by the indicator: down its slope where it is between outside and inside, up where another part encloses the
/// point.
std::vector<Vec3> normals_of(const Indicator& indicator, const std::vector<Vec3>& points, double enclosed) {
    std::vector<Vec3> normals(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        const auto [inside, g, cell] = indicator.at(points[n]);
        const double sign = inside < 0 || inside > enclosed ? 1 : -1;
        normals[n] = unit({sign * g[0], sign * g[1], sign * g[2]});
    });
    return normals;
}

/// Of the finest grid: no finer than so many points tell.
double finest_cell(const CloudScale& scale, std::size_t points) {
    const double apart = scale.spacing * std::sqrt(std::max(1.0, double(points) / kOrientation.most_sampled));
    return std::max(kOrientation.cell_spacings * apart, kOrientation.cell_noises * scale.noise);
}

/// The same of the first tries: on larger cells fewer normals turn, and only thin parts ask for smaller ones.
double first_cell(const CloudScale& scale, const std::vector<Vec3>& points) {
    return std::max(finest_cell(scale, points.size()), cloud::indicator_side(points) / kOrientation.first_along);
}

/// Parts that are turned as a whole go on turning, or lie where the indicator is not 1/2.
double doubt(const Orientation& o, double weight = kOrientation.off_weight) {
    return o.turned + weight * std::max(0.0, o.off_half - kOrientation.off_half);
}
bool is_settled(const Orientation& o) { return doubt(o, 1) < kGivenSides.few_turned; }

/// Share of the surface that lies far from every point.
double share_bare(const CloudOrientation& cloud) {
    const double reach = kOrientation.bare_reach * std::max(cloud.scale.spacing, cloud.scale.noise);
    return cloud::share_bare(*cloud.orientation.indicator, cloud.points, reach);
}

bool does_enclose(const CloudOrientation& cloud) {
    return doubt(cloud.orientation) < kOrientation.settled || share_bare(cloud) < kOrientation.bare;
}

/// Share of the points that the indicator's level 1/2 passes by at more than that distance.
double share_passed(const Indicator& indicator, const std::vector<Vec3>& points, double reach) {
    std::vector<char> passed(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        const Indicator::Sample at = indicator.at(points[n]);
        const double slope = std::hypot(at.gradient[0], at.gradient[1], at.gradient[2]);
        passed[n] = std::abs(at.inside - 0.5) > reach * slope;
    });
    return double(std::count(passed.begin(), passed.end(), 1)) / double(points.size());
}

/// Every few points of those that lie together, and what each stands for.
struct Sample {
    Sample(const std::vector<Vec3>& all, double spacing, std::size_t every)
        : step(every), order(cloud::PointCells(all, kOrientation.sample_spacings * spacing).order()) {
        for (std::size_t n = step / 2; n < order.size(); n += step) points.push_back(all[order[n]]);
        areas = cloud::areas_of(points, spacing * std::sqrt(double(step)));
    }
    /// Of all points.
    [[nodiscard]] std::vector<double> all_areas() const {
        std::vector<double> all(order.size());
        for (std::size_t n = 0; n < order.size(); ++n)
            all[order[n]] = areas[std::min(n / step, areas.size() - 1)] / double(step);
        return all;
    }
    std::size_t step;
    std::vector<std::uint32_t> order;
    std::vector<Vec3> points;
    std::vector<double> areas;
};

/// The indicator that was found may be too coarse for what its normals tell.
void refine(CloudOrientation& cloud, const RunContext& run) {
    Orientation& o = cloud.orientation;
    const double noise = cloud.scale.noise, spacing = cloud.scale.spacing;
    // Where normals are beyond doubt, the surface may be as fine as the points tell.
    const double first =
        is_settled(o) ? finest_cell(cloud.scale, cloud.points.size()) : first_cell(cloud.scale, cloud.points);
    const double cell = cloud::indicator_cell(cloud.points, first);
    if (o.indicator->cell() > kOrientation.coarse * cell)
        o.indicator = cloud::indicator_of(cloud.points, o, first, run);
    if (!is_settled(o) && noise < kOrientation.little_noise * spacing &&
        share_passed(*o.indicator, cloud.points, kOrientation.passed_reach * spacing) > kOrientation.many_passed)
        o.indicator = cloud::indicator_of(cloud.points, o, kOrientation.strain_cells * first, run);
}

/// Of points that enclose nothing as they are oriented.
/// @param reach  distance at which a surface passes a point by
void choose_by_views(CloudOrientation& cloud, double reach, const RunContext& run) {
    const double passed = share_passed(*cloud.orientation.indicator, cloud.points, reach);
    const bool mostly_bare = share_bare(cloud) > kOrientation.mostly_bare;
    if (mostly_bare && passed > 0) {
        // What closes a scan of one side is larger than the scan, and turns parts of it; where they were seen from
        // tells.
        cloud::GivenSides seen = cloud::given_sides(cloud.points, cloud::hints_by_views(cloud.points, cloud.scale),
                                                    cloud.scale, first_cell(cloud.scale, cloud.points), run);
        if (seen.report.used && share_passed(*seen.orientation.indicator, cloud.points, reach) <
                                    std::min(passed, kOrientation.many_passed)) {
            cloud.orientation = std::move(seen.orientation);
            cloud.encloses = true;
            return;
        }
    }
    Orientation seen = cloud::orient_by_views(cloud.points, cloud.scale, run);
    // Normals waver in the folds of a closed surface, too; but there views pass by most points.
    cloud.encloses = (!mostly_bare || passed < kOrientation.many_passed) &&
                     passed < kOrientation.fewer_passed * share_passed(*seen.indicator, cloud.points, reach);
    if (!cloud.encloses) cloud.orientation = std::move(seen);
}

/// By the hints where they are consistent and nothing that is certain contradicts them, else by itself, else by views.
void choose_orientation(CloudOrientation& cloud, const PointHints& hints, const RunContext& run) {
    cloud::GivenSides given =
        cloud::given_sides(cloud.points, hints, cloud.scale, first_cell(cloud.scale, cloud.points), run);
    HintsReport& report = cloud.hints = given.report;
    const bool is_certain = report.used && given.torn < kOrientation.few_torn && is_settled(given.orientation);
    if (!is_certain) {
        cloud.orientation = orient(cloud.points, cloud.scale, run);
        cloud.encloses = does_enclose(cloud);
        const double reach = kOrientation.passed_reach * cloud.scale.spacing;
        if (report.used && cloud.encloses &&
            1 - cloud::agreeing(cloud.points, given.orientation.normals, cloud.orientation, false) >
                kOrientation.contradicted &&
            // In narrow folds it is these that are wrong.
            share_passed(*cloud.orientation.indicator, cloud.points, reach) <=
                share_passed(*given.orientation.indicator, cloud.points, reach)) {
            report.used = false;
            report.why_not = "parts of them are turned as a whole";
        }
        if (!report.used && !cloud.encloses) choose_by_views(cloud, reach, run);
        if (!report.used && cloud.encloses) refine(cloud, run);
    }
    if (report.used) {
        cloud.orientation = std::move(given.orientation);
        cloud.encloses = true;
    }
    report.agree = cloud::agreeing(cloud.points, given.given, cloud.orientation, report.inward);
}

/// What speaks against normals on a lattice finer than theirs: points that their surface passes by, and normals that
/// their indicator turns. Where walls of folds were taken for each other there are more of both, whatever they have on
/// their own.
double strain(const std::vector<Vec3>& points, std::vector<Vec3> normals, std::vector<double> areas, double cell,
              double reach, const RunContext& run) {
    Orientation o;
    o.normals = std::move(normals);
    o.areas = std::move(areas);
    o.indicator = cloud::indicator_of(points, o, cell, run);
    const double turned = 1 - cloud::agreeing(points, o.normals, o, false);
    return share_passed(*o.indicator, points, reach) + kOrientation.strain_turned * turned;
}

struct Tried {
    Orientation orientation;
    double strain = 0;
};

/// Leaves those that are hardly more strained than any.
void keep_least_strained(std::vector<Tried>& tried) {
    double least = tried.front().strain;
    for (const Tried& t : tried) least = std::min(least, t.strain);
    std::erase_if(tried, [&](const Tried& t) { return t.strain > kOrientation.same_strain * least; });
}

}  // namespace

Orientation orient(const std::vector<Vec3>& points, const CloudScale& scale, const RunContext& run) {
    if (points.size() < 4)
        throw Error(Errc::InvalidInput, "orient: expected at least 4 points, got " + std::to_string(points.size()));
    if (!(longest_side(bounding_box(points)) > 0) || !(scale.spacing > 0))
        throw Error(Errc::InvalidInput, "orient: all points lie at one place");
    Orientation best;
    with_threads(run, [&] {
        // Noise is hard to tell from thin parts: where normals go on turning a finer lattice may hold them.
        const double first = first_cell(scale, points);
        // Parts thinner than the first cells need those that the points' spacing allows.
        const double finest = finest_cell(scale, points.size()), cell = cloud::indicator_cell(points, finest);
        const double share = std::min(kOrientation.sampled_per_cell * scale.spacing * scale.spacing / (cell * cell),
                                      kOrientation.most_sampled / double(points.size()));
        const bool is_sharp = scale.noise < kOrientation.sharp * scale.spacing;
        const double most = std::max(1.0, double(points.size() / kOrientation.least_sampled));
        const Sample sample(points, scale.spacing, std::size_t(std::clamp(1 / share, 1.0, most)));
        const double reach = kOrientation.passed_reach * std::max(scale.spacing, scale.noise);
        std::vector<std::tuple<double, double, double>> lattices;
        std::vector<Tried> tried;
        std::vector<Try> tries(std::begin(kTries), std::end(kTries));
        if (first > kOrientation.coarse * finest)
            tries.insert(tries.begin() + 3,
                         Try{finest / first, kOrientation.surely_enclosed, kOrientation.finer_first_cells});
        const double strain_cell = kOrientation.strain_cells * finest;
        for (const Try& attempt : tries) {
            const double tried_cell = cloud::indicator_cell(
                points, std::max(first * attempt.cell, kOrientation.least_spacings * scale.spacing));
            const std::tuple lattice{tried_cell, attempt.enclosed, attempt.first_guess};
            if (std::count(lattices.begin(), lattices.end(), lattice) > 0) continue;
            lattices.push_back(lattice);
            Orientation now;
            now.areas = sample.areas;
            Iteration iteration(sample.points, sample.areas, attempt.first_guess, run);
            for (const Stage& stage : {Stage{1.5 * tried_cell, 12, false, attempt.enclosed},
                                       Stage{tried_cell, 8, true, kOrientation.surely_enclosed}})
                iteration.run(stage, now);
            if (is_sharp) iteration.mend(scale.spacing * std::sqrt(double(sample.step)), now);
            now.indicator = cloud::make_indicator(iteration.last());
            now.off_half = std::abs(cloud::mean_at(iteration.last(), sample.points) - 0.5);
            const bool settled = is_settled(now);
            if (settled && attempt.cell >= 1) {
                tried.clear();
                tried.push_back({std::move(now), 0});
                break;
            }
            const double its = strain(points, normals_of(*now.indicator, points, kOrientation.surely_enclosed),
                                      sample.all_areas(), strain_cell, reach, run);
            tried.push_back({std::move(now), its});
            keep_least_strained(tried);  // each has an indicator, which is large
            if (settled && its < kOrientation.no_strain) break;
        }
        best = std::move(std::min_element(tried.begin(), tried.end(), [](const Tried& a, const Tried& b) {
                             return doubt(a.orientation) < doubt(b.orientation);
                         })->orientation);
        const double half = std::accumulate(best.areas.begin(), best.areas.end(), 0.0) /
                            std::accumulate(sample.areas.begin(), sample.areas.end(), 0.0);
        best.areas = sample.all_areas();
        for (double& area : best.areas) area *= half;
        best.normals = normals_of(*best.indicator, points, kOrientation.surely_enclosed);
        if (best.mended > 0) best.mended = cloud::mend_torn(points, scale.spacing, best.normals);
    });
    return best;
}

CloudOrientation orient_cloud(const std::vector<Vec3>& points, const RunContext& run) {
    return orient_cloud(points, {}, run);
}

CloudOrientation orient_cloud(const std::vector<Vec3>& points, const PointHints& hints, const RunContext& run) {
    CloudOrientation cloud;
    with_threads(run, [&] {
        cloud.points = merge_close_points(points, 0);
        cloud.scale = measure_cloud_scale(cloud.points, run);
        // Where there are many, some show once others are gone.
        for (int round = 0; round < kOrientation.stray_rounds; ++round) {
            const std::vector<char> stray = cloud::find_stray(cloud.points, cloud.scale, run);
            std::size_t kept = 0;
            for (std::size_t n = 0; n < stray.size(); ++n)
                if (!stray[n]) cloud.points[kept++] = cloud.points[n];
            const std::size_t gone = stray.size() - kept;
            cloud.stray += gone;
            cloud.points.resize(kept);
            if (double(gone) < kOrientation.many_stray * double(stray.size())) break;
        }
        choose_orientation(cloud, carried(hints, points, cloud.points), run);
    });
    return cloud;
}

}  // namespace covol
