// Image guidance: where, between the marks, the image shows the border that it shows at the marks.
#include "covol/guidance.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <optional>

#include "covol/band.h"
#include "covol/domain.h"
#include "covol/error.h"
#include "covol/surface.h"
#include "detail/kd_tree.h"
#include "detail/nearest.h"
#include "detail/redistance.h"
#include "guidance/border_profile.h"
#include "guidance/offset_field.h"
#include "guidance/patches.h"
#include "guidance/smooth_image.h"

namespace covol {
namespace {

using namespace guidance;

constexpr double kLeastResponse = 0.25;  // a field that hardly follows the image cannot tell how good the image is

bool debug() { return std::getenv("GUIDE_DEBUG") != nullptr; }
double env(const char* name, double value) { const char* t = std::getenv(name); return t ? std::atof(t) : value; }

struct Timer {
    std::chrono::steady_clock::time_point at = std::chrono::steady_clock::now();
    void operator()(const char* what) {
        const auto now = std::chrono::steady_clock::now();
        if (std::getenv("GUIDE_TIME")) std::fprintf(stderr, "    %-12s %.3f\n", what, std::chrono::duration<double>(now - at).count());
        at = now;
    }
};

struct Setting {
    const Image& image;
    const std::vector<Vec3>& marks;
    const GuidanceOptions& options;
    Domain domain;
    double h;
    double width;  // of the wide bands, voxels
};

Vec3 along(const Vec3& x, const Vec3& n, double s) { return {x[0] + s * n[0], x[1] + s * n[1], x[2] + s * n[2]}; }

float value_at(const FloatGrid::ConstAccessor& accessor, const Domain& domain, const Vec3& world) {
    const Vec3 at = domain.world_to_index(world);
    return openvdb::tools::BoxSampler::sample(accessor, openvdb::Vec3d(at[0], at[1], at[2]));
}

/// How far a profile of a patch's vertex may be read: to where another part of the surface is nearer, or the image ends.
PatchProfile read_profile(const Patches& p, std::size_t patch, int reach, const SmoothImage& image,
                          const FloatGrid& distance, const Domain& domain) {
    const auto accessor = distance.getConstAccessor();
    const double step = p.voxel[patch] / kStepsPerVoxel, h = domain.voxel_size;
    const std::uint32_t begin = p.first[patch], rows = p.first[patch + 1] - begin;
    struct Row { int lo, hi; std::vector<float> values; };
    std::vector<Row> all(rows);
    std::vector<int> los, his;
    for (std::uint32_t r = 0; r < rows; ++r) {
        const std::uint32_t v = p.members[begin + r];
        Row& row = all[r];
        row.values.resize(2 * std::size_t(reach) + 1);
        row.lo = 1;
        row.hi = -1;
        const Vec3 &x = p.places[v], &n = p.normals[v];
        if (!image.sample(x, row.values[reach])) continue;
        row.lo = row.hi = 0;
        for (int side = -1; side <= 1; side += 2)
            for (int s = side; std::abs(s) <= reach; s += side) {
                const Vec3 at = along(x, n, s * step);
                const double away = std::abs(s * step);
                const double nearest = side * value_at(accessor, domain, at);
                if (nearest < 0.7 * away - 1.0 * h) break;
                if (!image.sample(at, row.values[reach + s])) break;
                (side < 0 ? row.lo : row.hi) = s;
            }
        los.push_back(row.lo);
        his.push_back(row.hi);
    }
    PatchProfile profile;
    if (los.empty()) return profile;
    std::nth_element(los.begin(), los.begin() + los.size() / 2, los.end());
    std::nth_element(his.begin(), his.begin() + his.size() / 2, his.end());
    profile.lo = los[los.size() / 2];
    profile.hi = his[his.size() / 2];
    for (const Row& row : all)
        if (row.lo <= row.hi && row.lo <= profile.lo && row.hi >= profile.hi) {
            profile.values.insert(profile.values.end(), row.values.begin() + reach + profile.lo, row.values.begin() + reach + profile.hi + 1);
            ++profile.rows;
        }
    return profile;
}

struct MarkOnSurface {
    std::size_t mark, patch;
    double residual;   // world, outward
    double deviation;  // of the mark along the normal
};

/// Reliability of the image at a patch: see density().
struct Trust {
    double sharpness = 0;  // exponent of the likelihood
    double stray = 1;      // share of places where the image does not follow the profile
};

OffsetEvidence density(const std::vector<double>& log_likelihood, double first, double step, const Trust& trust) {
    OffsetEvidence e;
    e.first = first;
    e.step = step;
    const double top = *std::max_element(log_likelihood.begin(), log_likelihood.end());
    double sum = 0;
    e.density.resize(log_likelihood.size());
    for (std::size_t n = 0; n < log_likelihood.size(); ++n) sum += e.density[n] = float(std::exp(trust.sharpness * (log_likelihood[n] - top)));
    const double mean = sum / double(log_likelihood.size());
    for (float& d : e.density) d = float(trust.stray + (1 - trust.stray) * d / mean);
    return e;
}

struct Learnt {
    std::optional<BorderProfile> profile;
    std::vector<std::size_t> mark;  // of each place
    double sigma = 0;
    bool local = false;
    double radius = 0;              // of the local tables
    Trust trust;
    double gain = 0, gain_error = 0;
    std::vector<BorderTable> held_out;  // by place: learnt from the others
};

std::vector<double> around(const BorderProfile& profile, const Vec3& at, double radius) {
    std::vector<double> w;
    for (const MarkedPlace& place : profile.places()) w.push_back(std::exp(-0.5 * detail::squared_distance(place.at, at) / (radius * radius)));
    return w;
}

double neighbourhood(const BorderProfile& profile, int count) {
    std::vector<double> radii;
    for (const MarkedPlace& a : profile.places()) {
        std::vector<double> d;
        for (const MarkedPlace& b : profile.places()) d.push_back(detail::squared_distance(a.at, b.at));
        std::nth_element(d.begin(), d.begin() + count, d.end());
        radii.push_back(std::sqrt(d[count]));
    }
    std::nth_element(radii.begin(), radii.begin() + radii.size() / 2, radii.end());
    return radii[radii.size() / 2];
}

/// The log-likelihoods of the offsets that a profile allows, within `range` steps of 0.
bool offsets_of(const PatchProfile& p, const BorderTable& table, int range, int& first, std::vector<double>& out) {
    if (p.empty()) return false;
    first = std::max(-range, p.lo + 1);
    const int last = std::min(range, p.hi - 1);
    if (last - first < kStepsPerVoxel) return false;
    out.assign(std::size_t(last - first) + 1, 0.0);
    table.likelihood(p, first, out);
    return true;
}

struct Candidate { Learnt learnt; double score; };

/// Learns the profile from an image of one smoothness, and how well it foretells marks that it is not learnt from.
Learnt learn(const Setting& s, const Patches& patches, const std::vector<MarkOnSurface>& marks, const SmoothImage& image,
             const FloatGrid& distance, double guess_deviation, double prior_deviation, const std::vector<int>& ranges, double width) {
    std::vector<MarkedPlace> places(marks.size());
    tbb::parallel_for(std::size_t(0), marks.size(), [&](std::size_t n) {
        const MarkOnSurface& m = marks[n];
        const double step = patches.voxel[m.patch] / kStepsPerVoxel;
        places[n].profile = read_profile(patches, m.patch, ranges[m.patch] + 8 * kStepsPerVoxel, image, distance, s.domain);
        const double share = guess_deviation * guess_deviation / (guess_deviation * guess_deviation + m.deviation * m.deviation);
        places[n].offset = m.residual * share / step;
        places[n].at = s.marks[m.mark];
    });
    Learnt best;
    best.profile.emplace(std::move(places));
    const BorderProfile& profile = *best.profile;
    best.radius = marks.size() >= 40 ? neighbourhood(profile, 12) : 0;
    double best_score = -1e300;
    std::array<std::vector<BorderTable>, 2> held_out;
    for (int local = 0; local <= (best.radius > 0 ? 1 : 0); ++local) {
        // Likelihoods at each mark, by the profile of the others that do not share its patch.
        std::vector<std::vector<double>> log_likelihood(marks.size());
        std::vector<int> first(marks.size());
        held_out[local].resize(marks.size());
        tbb::parallel_for(std::size_t(0), marks.size(), [&](std::size_t n) {
            std::vector<double> all(marks.size(), 1.0), near;
            if (local) near = around(profile, profile.places()[n].at, best.radius);
            for (std::size_t k = 0; k < marks.size(); ++k)
                if (detail::squared_distance(profile.places()[k].at, profile.places()[n].at) < 4 * width * width) {
                    all[k] = 0;
                    if (local) near[k] = 0;
                }
            BorderTable& table = held_out[local][n];
            table = local ? profile.table(near, &all) : profile.table(all);
            if (!offsets_of(profile.places()[n].profile, table, ranges[marks[n].patch], first[n], log_likelihood[n])) log_likelihood[n].clear();
        });
        for (const double sharpness : {0.05, 0.1, 0.2, 0.4, 0.7, 1.0})
            for (const double stray : {0.02, 0.1, 0.25, 0.5}) {
                double sum = 0, squares = 0;
                std::size_t count = 0;
                for (std::size_t n = 0; n < marks.size(); ++n) {
                    if (log_likelihood[n].empty()) continue;
                    const double step = patches.voxel[marks[n].patch] / kStepsPerVoxel;
                    const OffsetEvidence e = density(log_likelihood[n], first[n] * step, step, {sharpness, stray});
                    // The mark is the border with its own error: mass of posterior near it against mass of the prior near it.
                    double mean, variance;
                    const double v = prior_deviation * prior_deviation, r = std::max(marks[n].deviation, 0.5 * step);
                    const double mass = moments(e, 0, v, mean, variance);
                    const double at = marks[n].residual * v / (v + r * r), spread = v * r * r / (v + r * r);
                    const double near = moments(e, at, spread, mean, variance);
                    const double gain = std::log(std::max(near, 1e-6) / std::max(mass, 1e-6));
                    sum += gain;
                    squares += gain * gain;
                    ++count;
                }
                if (count == 0) continue;
                const double mean = sum / double(count);
                const double error = std::sqrt(std::max(squares / double(count) - mean * mean, 0.0) / double(count));
                const double score = mean - error;
                if (score > best_score) {
                    best_score = score;
                    best.local = local == 1;
                    best.trust = {sharpness, stray};
                    best.gain = mean;
                    best.gain_error = error;
                }
            }
    }
    best.held_out = std::move(held_out[best.local]);
    return best;
}

/// u = distance to the surface less the offset of its nearest vertex.
FloatGridPtr moved(const FloatGrid& distance, const Patches& patches, const std::vector<double>& offset, const Setting& s,
                   const RunContext& run) {
    double largest = 0;
    for (const double o : offset) largest = std::max(largest, std::abs(o));
    std::vector<Vec3> places(patches.places.size());
    for (std::size_t v = 0; v < places.size(); ++v) places[v] = s.domain.world_to_index(patches.places[v]);
    const detail::NearestField nearest = detail::nearest_points(places, detail::box_of(s.domain), largest / s.h + 3, "guide", run);
    FloatGridPtr out = distance.deepCopy();
    out->tree().voxelizeActiveTiles();
    std::vector<const detail::NearestLeaf*> leaves;
    for (const auto& leaf : nearest.leaves) leaves.push_back(&leaf);
    std::vector<FloatGrid::TreeType::LeafNodeType*> targets;
    for (const auto* leaf : leaves) targets.push_back(out->tree().touchLeaf(leaf->origin));
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
        float* values = targets[n]->buffer().data();
        for (int p = 0; p < detail::kLeafSize; ++p) {
            const std::int32_t at = leaves[n]->nearest[p];
            if (at < 0) continue;
            values[p] -= float(offset[std::size_t(nearest.source[std::size_t(at)])]);
        }
    });
    return out;
}

/// Offsets of patches as a smooth function on the vertices.
std::vector<double> on_vertices(const Patches& p, const std::vector<double>& offset, double width) {
    std::vector<std::vector<std::uint32_t>> neighbours(p.size());
    for (const auto& b : p.borders) {
        neighbours[b.a].push_back(b.b);
        neighbours[b.b].push_back(b.a);
    }
    std::vector<double> out(p.places.size());
    tbb::parallel_for(std::size_t(0), p.places.size(), [&](std::size_t v) {
        const std::uint32_t own = p.patch[v];
        double sum = 0, total = 0;
        const auto add = [&](std::uint32_t i) {
            const double w = std::exp(-0.5 * detail::squared_distance(p.places[v], p.centers[i]) / (0.49 * width * width)) + 1e-12;
            sum += w * offset[i];
            total += w;
        };
        add(own);
        for (const std::uint32_t i : neighbours[own]) add(i);
        out[v] = sum / total;
    });
    return out;
}

[[maybe_unused]] double median(std::vector<double> v) {
    if (v.empty()) return 0;
    std::nth_element(v.begin(), v.begin() + v.size() / 2, v.end());
    return v[v.size() / 2];
}

}  // namespace

std::string GuidanceOptions::why_invalid() const {
    std::string why;
    if (!(weight >= 0 && weight <= 1)) why += "weight: expected 0 to 1, got " + std::to_string(weight) + "\n";
    if (std::isnan(mark_precision)) why += "mark_precision: expected a number\n";
    if (std::isnan(range)) why += "range: expected a number\n";
    return why;
}

FloatGridPtr guide(const FloatGrid& guess, const std::vector<Vec3>& marks, const Image& image, const GuidanceOptions& options,
                   GuidanceReport& report, const RunContext& run) {
    if (const std::string why = options.why_invalid(); !why.empty()) throw Error(Errc::InvalidOptions, "guide: " + why);
    report = {};
    FloatGridPtr result;
    with_threads(run, [&] {
        Setting s{image, marks, options, domain_of(guess), 0, 16};
        s.h = s.domain.voxel_size;
        Timer timer;
        const FloatGridPtr start = detail::redistance(guess, s.domain, s.width, detail::DomainEnd::Closed, "guess", run);
        FloatGridPtr current = start;
        timer("redistance");
        double guess2 = -1, misfit = 0, chosen_prior = 0, chosen_sigma = 0;
        const int iterations = int(env("GUIDE_ITER", 2));
        for (int iteration = 0; iteration < iterations; ++iteration) {
            run.check();
            const TriangleMesh mesh = extract_mesh(*current, {}, run);
            double area = 0;
            const double width0 = env("GUIDE_WIDTH", 2) * s.h;
            Patches patches = make_patches(mesh, image.geometry(), width0, int(env("GUIDE_NORMALS", 6)));
            for (const double a : patches.area) area += a;
            const double spacing = std::sqrt(area / double(std::max<std::size_t>(marks.size(), 1)));
            double width = width0;
            if (spacing / env("GUIDE_CELLS", 4) > width) {
                width = spacing / env("GUIDE_CELLS", 4);
                patches = make_patches(mesh, image.geometry(), width, int(env("GUIDE_NORMALS", 6)));
            }
            const std::size_t count = patches.size();

            timer("patches");
            // Distances to marks, and the marks on the surface.
            std::vector<double> to_mark(count);
            {
                const detail::KdTree tree(marks);
                tbb::parallel_for(std::size_t(0), count, [&](std::size_t i) { to_mark[i] = std::sqrt(tree.nearest(patches.centers[i])); });
            }
            std::vector<MarkOnSurface> on(marks.size());
            {
                const auto accessor_source = current;
                tbb::parallel_for(std::size_t(0), marks.size(), [&](std::size_t m) {
                    const auto accessor = accessor_source->getConstAccessor();
                    double best = 1e300;
                    for (std::size_t v = 0; v < patches.places.size(); ++v) {
                        const double d = detail::squared_distance(patches.places[v], marks[m]);
                        if (d < best) {
                            best = d;
                            on[m].patch = patches.patch[v];
                        }
                    }
                    on[m].mark = m;
                    on[m].residual = value_at(accessor, s.domain, marks[m]);
                    const double precision = options.mark_precision >= 0 ? options.mark_precision : patches.voxel[on[m].patch];
                    on[m].deviation = precision / std::sqrt(12.0);
                });
            }
            double residual2 = 0, mark2 = 0;
            for (const auto& m : on) {
                residual2 += std::min(m.residual * m.residual, 100 * s.h * s.h) / double(on.size());
                mark2 += m.deviation * m.deviation / double(on.size());
            }
            if (iteration == 0) {
                guess2 = std::max(std::abs(residual2 - mark2), 0.1 * mark2);
                misfit = std::clamp((residual2 - mark2) / mark2, 0.0, 1.0);
            }

            // The prior: back to the guess.
            std::vector<double> home(count), broad(count);
            std::vector<int> ranges(count);
            {
                tbb::parallel_for(std::size_t(0), count, [&](std::size_t i) {
                    const auto accessor = start->getConstAccessor();
                    for (std::uint32_t n = patches.first[i]; n < patches.first[i + 1]; ++n)
                        home[i] -= value_at(accessor, s.domain, patches.places[patches.members[n]]) / (patches.first[i + 1] - patches.first[i]);
                    double reach = std::min(env("GUIDE_SLOPE", 0.5) * to_mark[i] + 2 * patches.voxel[i], 12 * s.h);
                    if (options.range >= 0) reach = std::min(reach, options.range);
                    reach += std::abs(home[i]);
                    ranges[i] = int(std::ceil(std::min(reach, (s.width - 2) * s.h) * kStepsPerVoxel / patches.voxel[i]));
                    broad[i] = 0.5 * std::min(0.5 * to_mark[i] + 2 * patches.voxel[i], 12 * s.h);
                });
            }
            double broad2 = 0;
            for (std::size_t i = 0; i < count; ++i) broad2 += patches.area[i] * broad[i] * broad[i] / area;
            // Marks are asked as any other place is: as if the guess were no better there.
            for (std::size_t i = 0; i < count; ++i)
                ranges[i] = std::max(ranges[i], int(std::ceil(std::min(2 * std::sqrt(broad2) + std::abs(home[i]), (s.width - 2) * s.h) * kStepsPerVoxel / patches.voxel[i])));

            timer("marks");
            // Learn at the marks; the smoothness that foretells best.
            WorldBox box{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
            for (const Vec3& x : patches.places)
                for (int a = 0; a < 3; ++a) {
                    box.min[a] = std::min(box.min[a], x[a] - s.width * s.h);
                    box.max[a] = std::max(box.max[a], x[a] + s.width * s.h);
                }
            Learnt best;
            std::optional<SmoothImage> smooth;
            double best_score = -1e300;
            for (const double sigma : {0.5, 1.0, 2.0}) {
                if (iteration > 0 && sigma * s.h != chosen_sigma) continue;
                SmoothImage candidate(image, box, sigma * s.h);
                if (candidate.empty()) break;
                Learnt learnt = learn(s, patches, on, candidate, *current, std::sqrt(guess2), std::sqrt(broad2), ranges, width);
                if (debug())
                    std::fprintf(stderr, "  it %d sigma %.1f local %d sharp %.2f stray %.2f gain %.3f +- %.3f\n", iteration, sigma, learnt.local,
                                 learnt.trust.sharpness, learnt.trust.stray, learnt.gain, learnt.gain_error);
                if (learnt.gain - learnt.gain_error > best_score) {
                    best_score = learnt.gain - learnt.gain_error;
                    learnt.sigma = sigma * s.h;
                    best = std::move(learnt);
                    smooth.emplace(std::move(candidate));
                }
            }
            run.check();
            if (!(best_score > 0)) {
                report.reason = "the image does not foretell the marks";
                break;
            }

            timer("learn");
            // Evidence everywhere; `honest` is learnt without the nearest mark.
            std::vector<OffsetEvidence> evidence(count), honest(count);
            std::vector<std::size_t> nearest_mark(count);
            std::vector<BorderTable> tables;
            std::vector<double> ones(best.profile->places().size(), 1.0);
            if (best.local) {
                tables.resize(ones.size());
                tbb::parallel_for(std::size_t(0), tables.size(), [&](std::size_t n) {
                    const std::vector<double> near = around(*best.profile, best.profile->places()[n].at, best.radius);
                    tables[n] = best.profile->table(near, &ones);
                });
            } else {
                tables.push_back(best.profile->table(ones));
            }
            tbb::parallel_for(std::size_t(0), count, [&](std::size_t i) {
                PatchProfile p = read_profile(patches, i, ranges[i] + 3 * kStepsPerVoxel, *smooth, *current, s.domain);
                best.profile->to_levels(p);
                double nearest = 1e300;
                for (std::size_t n = 0; n < ones.size(); ++n) {
                    const double d = detail::squared_distance(best.profile->places()[n].at, patches.centers[i]);
                    if (d < nearest) {
                        nearest = d;
                        nearest_mark[i] = n;
                    }
                }
                int first;
                std::vector<double> log_likelihood;
                const double step = patches.voxel[i] / kStepsPerVoxel;
                if (offsets_of(p, tables[best.local ? nearest_mark[i] : 0], ranges[i], first, log_likelihood))
                    evidence[i] = density(log_likelihood, first * step, step, best.trust);
                if (offsets_of(p, best.held_out[nearest_mark[i]], ranges[i], first, log_likelihood))
                    honest[i] = density(log_likelihood, first * step, step, best.trust);
            });
            run.check();

            timer("evidence");
            // The image alone, then how far off it is at the marks, and how far off the guess is between them.
            const OffsetField field(patches, std::max(env("GUIDE_RANGE", 1.0) * spacing, 4 * s.h));
            std::vector<double> none(count, 0.0), zero(count, 0.0), deviation(count, std::sqrt(broad2));
            double distance2 = 0, distance4 = 0;
            for (std::size_t i = 0; i < count; ++i) distance4 += patches.area[i] * std::pow(to_mark[i], 4) / area;
            for (std::size_t i = 0; i < count; ++i) distance2 += patches.area[i] * to_mark[i] * to_mark[i] / area;
            timer("field");
            // The image's field for a guess that may be this far off: how far it errs at the marks, how much of a
            // deviation of the guess it would undo, and how far off it finds the guess where marks are far.
            struct Word { double prior2, error2, response, slope2; };
            std::vector<Word> words;
            const double size = 3 * measure(mesh).volume / area;
            const double bend = env("GUIDE_BEND", 0.15) / size;  // of the sagitta d^2 / (2 size) interpolation leaves about a third
            const double least2 = bend * bend * distance4;
            std::vector<double> shift(count);
            for (std::size_t i = 0; i < count; ++i) {
                const Vec3& x = patches.centers[i];
                shift[i] = std::cos(M_PI / spacing * (x[0] + x[1] + x[2]) / std::sqrt(3.0));
            }
            for (double prior = iteration > 0 ? chosen_prior : std::sqrt(broad2); prior > 0.1 * s.h && words.size() < (iteration > 0 ? 1 : 5); prior *= 0.5) {
                std::fill(deviation.begin(), deviation.end(), prior);
                const OffsetField::Fit fit = field.fit(home, deviation, honest, zero, none, &shift);
                double sum = 0, squares = 0, moved2 = 0, kept = 0, shift2 = 0;
                for (const auto& m : on) {
                    const double off = fit.offset[m.patch] - m.residual;
                    sum += off * off;
                    squares += off * off * off * off;
                }
                const double marks_count = double(on.size()), mean = sum / marks_count;
                const double uncertain = std::sqrt(std::max(squares / marks_count - mean * mean, 0.0) / marks_count);
                const double error2 = std::max(mean + env("GUIDE_SE", 1) * uncertain - mark2, mark2 * std::sqrt(2 / marks_count));
                std::vector<double> slopes(on.size(), 0.0);
                for (std::size_t i = 0; i < count; ++i) {
                    const double squared = (fit.offset[i] - home[i]) * (fit.offset[i] - home[i]);
                    moved2 += patches.area[i] / area * squared;
                    kept += patches.area[i] * fit.carried[i] * shift[i];
                    shift2 += patches.area[i] * shift[i] * shift[i];
                    slopes[nearest_mark[i]] += patches.area[i] / area * to_mark[i] * to_mark[i] / distance4 * (squared - guess2 - error2);
                }
                const double response = std::clamp(1 - kept / shift2, 0.01, 1.0);
                double slope2 = 0, slope_variance = 0;
                for (const double b : slopes) slope2 += b;
                for (const double b : slopes) slope_variance += std::pow(b - slope2 / marks_count, 2);
                const double full2 = slope2;
                slope2 = std::max(slope2 - env("GUIDE_SE2", 1) * std::sqrt(slope_variance), 0.0);
                words.push_back({prior * prior, error2, response, slope2});
                if (debug())
                    std::fprintf(stderr, "  it %d patches %zu spacing %.2f residual %.3f mark %.3f prior %.2f image error %.3f response %.2f moved %.3f slope %.3f (%.3f) d %.2f (voxels)\n",
                                 iteration, count, spacing / s.h, std::sqrt(residual2) / s.h, std::sqrt(mark2) / s.h, prior / s.h, std::sqrt(error2) / s.h,
                                 response, std::sqrt(moved2) / s.h, std::sqrt(slope2), std::sqrt(std::max(full2, 0.0)), std::sqrt(distance2) / s.h);
            }
            double slope2 = 0;
            for (const Word& w : words) slope2 = std::max(slope2, w.slope2);
            Word chosen = words.front();
            for (const Word& w : words)
                if (w.response >= kLeastResponse && w.prior2 >= guess2 + std::max(slope2 * distance2, least2) && w.error2 / (w.response * w.response) < chosen.error2 / (chosen.response * chosen.response)) chosen = w;
            chosen_prior = std::sqrt(chosen.prior2);
            chosen_sigma = best.sigma;
            const double error2 = chosen.error2, response = chosen.response;
            if (debug()) std::fprintf(stderr, "  chosen prior %.3f response %.3f error %.3f slope %.3f\n", std::sqrt(chosen.prior2) / s.h, response, std::sqrt(error2) / s.h, std::sqrt(slope2));
            std::vector<double> guess_variance(count);
            double guess_mean2 = 0;
            for (std::size_t i = 0; i < count; ++i) {
                const double d2 = to_mark[i] * to_mark[i];
                guess_variance[i] = guess2 + std::max(slope2 * d2, bend * bend * d2 * d2);
                guess_mean2 += patches.area[i] / area * guess_variance[i];
            }
            for (std::size_t i = 0; i < count; ++i)
                deviation[i] = std::sqrt(chosen.prior2 * (error2 + guess_variance[i]) / (error2 + guess_mean2));
            const OffsetField::Fit fit = field.fit(home, deviation, evidence, zero, none, nullptr);
            timer("fits");
            // Truth between guess and image, and through the marks.
            std::vector<double> offset(count), left(count), rest(count, 0.0), rest_precision(count, 0.0);
            for (std::size_t i = 0; i < count; ++i) {
                const double share = std::min(options.weight * response * guess_variance[i] / (response * response * guess_variance[i] + error2), 1.0);
                offset[i] = home[i] + share * (fit.offset[i] - home[i]);
                left[i] = std::sqrt(guess_variance[i] * error2 / (response * response * guess_variance[i] + error2));
            }
            for (const auto& m : on) {
                const double precision = misfit / (m.deviation * m.deviation + 0.01 * s.h * s.h);
                rest[m.patch] += precision * (m.residual - offset[m.patch]);
                rest_precision[m.patch] += precision;
            }
            for (std::size_t i = 0; i < count; ++i)
                if (rest_precision[i] > 0) rest[i] /= rest_precision[i];
            if (misfit > 0) {
                const OffsetField::Fit correction = field.fit(zero, left, std::vector<OffsetEvidence>(count), rest, rest_precision, nullptr);
                for (std::size_t i = 0; i < count; ++i) offset[i] += correction.offset[i];
            }
            if (const char* path = std::getenv("GUIDE_DUMP")) {
                std::FILE* f = std::fopen((std::string(path) + std::to_string(iteration)).c_str(), "w");
                for (std::size_t i = 0; i < count; ++i)
                    std::fprintf(f, "%g %g %g %g %g %g %g %g %g %g %g %g %g\n", patches.centers[i][0], patches.centers[i][1], patches.centers[i][2],
                                 patches.directions[i][0], patches.directions[i][1], patches.directions[i][2], patches.area[i], to_mark[i], home[i],
                                 fit.offset[i], fit.precision[i], offset[i], deviation[i]);
                std::fclose(f);
            }
            timer("final");
            current = moved(*current, patches, on_vertices(patches, offset, width), s, run);
            current = detail::redistance(*current, s.domain, s.width, detail::DomainEnd::Closed, "guess", run);
            timer("move");
            report.used = true;
            report.sigma = best.sigma;
            report.local = best.local;
            report.gain = best.gain;
            report.image_error = std::sqrt(error2);
            report.guess_error = std::sqrt(guess_mean2);
        }
        result = start_from_grid(s.domain, report.used ? *current : guess, run);
    });
    return result;
}

}  // namespace covol
