#include "covol/inference.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "base/median.h"
#include "covol/domain.h"
#include "covol/error.h"
#include "covol/guess.h"
#include "covol/start.h"
#include "grid/levels_at.h"
#include "guess/marks_surface.h"
#include "inference/candidate.h"
#include "inference/heuristics.h"
#include "inference/wrong_marks.h"
#include "points/kd_tree.h"

namespace covol {
namespace {

using namespace inference;
using guess::Search;

constexpr std::array kSigmas{1.0, 2.0};  // [cells] scales of the gradients that are used as axes

/// Signed distances of held-out marks from surfaces, negative inside.
struct HeldOut {
    std::vector<Vec3> marks;
    std::vector<double> of_body, of_guess;
    std::vector<double> to_rest2;  // squared distance to the nearest mark of the training set

    /// Weighted mean of of_guess and of_body. @param shrink  factor by which a finer lattice reduces of_body
    [[nodiscard]] double of_both(std::size_t n, double guess_weight, double shrink = 1) const {
        return guess_weight * of_guess[n] + (1 - guess_weight) * shrink * of_body[n];
    }
};

class Inference {
public:
    Inference(const Image& image, Marks marks, const RunContext& run)
        : image_(image), marks_(std::move(marks)), run_(run) {
        choose_box();
    }

    /// The lattice on which candidates are compared.
    [[nodiscard]] Lattice coarse_lattice() const {
        return cover(image_.geometry(), box_.min, box_.max, kInference.coarse_nodes);
    }

    /// Computes the best candidate; false if no candidate has a body.
    [[nodiscard]] bool find(InferenceReport& report);
    /// The body that was found, on a finer lattice.
    [[nodiscard]] Solid refined() const;
    /// Leaves out further marks that are probably wrong; returns false if there are none, or too many. Otherwise the
    /// body has to be recomputed.
    [[nodiscard]] bool leave_out_wrong(const HeldOut& held);
    [[nodiscard]] bool leaves_out(const Vec3& mark) const {
        return std::find(wrong_.begin(), wrong_.end(), mark) != wrong_.end();
    }
    [[nodiscard]] HeldOut hold_out() const;
    /// The body's level set, averaged with the surface through the marks. @param guess_weight  of that surface
    [[nodiscard]] Field pooled(const Solid& body, double guess_weight) const;
    [[nodiscard]] double coarse_cell() const { return coarse_->lattice.finest(); }

private:
    void choose_box();
    [[nodiscard]] Candidate best_candidate() const;
    [[nodiscard]] Proposal near_normals_of(const Solid& body, double amplitude) const {
        return {normals_of(body, marks_.places), Search::Near, amplitude};
    }

    const Image& image_;
    Marks marks_;
    const RunContext& run_;
    WorldBox box_;  // box around the marks, in the image's frame
    std::optional<Scene> coarse_;
    Solid coarse_body_;
    std::vector<Vec3> wrong_;  // marks that are left out; positions in the frame
    double amplitude_ = 0;     // of the variational surface of coarse_body_'s candidate
};

Candidate Inference::best_candidate() const {
    std::vector<Candidate> found{propose(*coarse_, {}, run_)};  // with normals from the marks alone
    const double amplitude = found.front().amplitude;
    const auto propose_all = [&](const std::vector<Proposal>& proposals) {
        const std::size_t before = found.size();
        found.resize(before + proposals.size());
        tbb::parallel_for(std::size_t(0), proposals.size(),
                          [&](std::size_t n) { found[before + n] = propose(*coarse_, proposals[n], run_); });
    };
    std::vector<Proposal> proposals;
    for (const double sigma : kSigmas) {
        const std::vector<Vec3> axes = image_axes(*coarse_, sigma);
        proposals.push_back({axes, Search::Wide, amplitude});
        // If the body is darker, or brighter, than all its surroundings, the gradients themselves are the normals.
        proposals.push_back({axes, Search::Near, amplitude});
    }
    propose_all(proposals);
    const auto best = [&](bool to_continue) {
        Candidate* result = nullptr;
        for (Candidate& c : found)
            if (!c.solid.empty() && !(to_continue && c.was_continued) && (result == nullptr || c.score > result->score))
                result = &c;
        return result;
    };
    for (int round = 0; round < kCommon.rounds; ++round) {
        Candidate* const from = best(true);
        if (from == nullptr) break;
        from->was_continued = true;
        propose_all({near_normals_of(from->solid, amplitude)});
    }
    Candidate* chosen = best(false);
    return chosen != nullptr ? std::move(*chosen) : Candidate{};
}

void Inference::choose_box() {
    const double voxel = image_.geometry().smallest_spacing();
    box_ = bounding_box(marks_.places, std::max(kBeyondVoxels * voxel, marks_.spacing));
}

bool Inference::find(InferenceReport& report) {
    coarse_.emplace(image_, coarse_lattice(), marks_, run_);
    Candidate chosen = best_candidate();
    report.bits = chosen.bits;
    amplitude_ = chosen.amplitude;
    coarse_body_ = std::move(chosen.solid);
    return !coarse_body_.empty();
}

Solid Inference::refined() const {
    const Lattice fine = cover(image_.geometry(), box_.min, box_.max, fine_nodes());
    if (fine.count() <= coarse_->lattice.count()) return coarse_body_;
    const Scene scene(image_, fine, marks_, run_);
    Proposal refining = near_normals_of(coarse_body_, amplitude_);
    refining.refine = &coarse_body_;
    refining.is_compared = false;
    const Candidate refined = propose(scene, refining, run_);
    return refined.solid.empty() ? coarse_body_ : refined.solid;
}

bool Inference::leave_out_wrong(const HeldOut& held) {
    // At least two wrong marks have to be expected, because a single suspect may lie on a part that the body lacks.
    if (kCommon.minority * double(held.marks.size()) < 2) return false;
    const Field level = coarse_body_.level();
    double anywhere = 0;
    for (const float value : level) anywhere += std::abs(double(value)) / double(level.size());
    // For each mark, the smaller one of its distances from the bodies that were computed with it and without it.
    std::vector<double> off;
    for (std::size_t i = 0; i < held.marks.size(); ++i)
        off.push_back(std::min(std::abs(coarse_body_.lattice.value(level, held.marks[i])), std::abs(held.of_body[i])));
    const std::vector<double> wrong = probability_wrong(off, anywhere, kUniformDeviation * coarse_cell());
    std::vector<Vec3> suspects;
    for (std::size_t i = 0; i < held.marks.size(); ++i)
        if (wrong[i] > 0.5) suspects.push_back(held.marks[i]);
    // Several suspects close to each other lie on a part that the body lacks. For random positions on a surface with
    // this median distance to the nearest one, the mean number within the radius `beside` is kCommon.ring.
    const double beside = std::sqrt(double(kCommon.ring) / std::numbers::ln2) * marks_.spacing;
    std::vector<Vec3> all = wrong_;
    for (const Vec3& suspect : suspects) {
        const auto neighbours = std::count_if(suspects.begin(), suspects.end(), [&](const Vec3& other) {
            return other != suspect && length(minus(other, suspect)) < beside;
        });
        if (neighbours < 2) all.push_back(suspect);
    }
    const double given = double(marks_.places.size() + wrong_.size());
    if (all.size() == wrong_.size() || all.size() < 2 || double(all.size()) > max_fraction_off() * given) return false;
    wrong_ = std::move(all);
    marks_ = marks_.without(wrong_, image_.geometry());
    choose_box();
    return true;
}

HeldOut Inference::hold_out() const {
    const std::vector<Vec3> normals = normals_of(coarse_body_, marks_.places);
    std::array<HeldOut, kFolds> by_fold;
    tbb::parallel_for(0, kFolds, [&](int fold) {
        std::vector<std::size_t> rest, out;
        const Marks part = marks_.without(fold, image_.geometry(), rest, out);
        std::vector<Vec3> of_rest;
        for (const std::size_t n : rest) of_rest.push_back(normals[n]);
        const Candidate again =
            propose(Scene(*coarse_, part), {of_rest, Search::Near, amplitude_, nullptr, false}, run_);
        if (again.solid.empty()) return;
        const Field level = again.solid.level();
        const guess::VariationalSurface surface = surface_near(part, of_rest, amplitude_);
        const detail::KdTree tree(part.places);
        HeldOut& held = by_fold[std::size_t(fold)];
        for (const std::size_t n : out) {
            const Vec3& mark = marks_.places[n];
            held.marks.push_back(mark);
            held.to_rest2.push_back(tree.nearest(mark));
            held.of_body.push_back(again.solid.lattice.value(level, mark));
            held.of_guess.push_back(surface.value(mark));
        }
    });
    HeldOut all;
    for (const HeldOut& held : by_fold) {
        all.marks.insert(all.marks.end(), held.marks.begin(), held.marks.end());
        all.of_body.insert(all.of_body.end(), held.of_body.begin(), held.of_body.end());
        all.of_guess.insert(all.of_guess.end(), held.of_guess.begin(), held.of_guess.end());
        all.to_rest2.insert(all.to_rest2.end(), held.to_rest2.begin(), held.to_rest2.end());
    }
    return all;
}

Field Inference::pooled(const Solid& body, double guess_weight) const {
    constexpr double kBandCells = 4;
    const Lattice& lattice = body.lattice;
    Field level = body.level();
    const guess::VariationalSurface surface = surface_near(marks_, normals_of(body, marks_.places), amplitude_);
    const detail::KdTree tree(marks_.places);
    const double cell = lattice.finest(), band = kBandCells * cell;
    const std::vector<KnownBall> balls = known_balls(marks_, cell);
    const auto is_known = [&](const Vec3& place) {  // the guess ignores known positions, and is not used there
        return std::any_of(balls.begin(), balls.end(), [&](const KnownBall& ball) {
            return length(minus(place, ball.middle)) <= ball.radius + cell;
        });
    };
    tbb::parallel_for(0, lattice.size[2], [&](int k) {
        for (int j = 0; j < lattice.size[1]; ++j)
            for (int i = 0; i < lattice.size[0]; ++i) {
                float& value = level[lattice.node(i, j, k)];
                if (std::abs(double(value)) > band) continue;
                const Vec3 place = lattice.place(i, j, k);
                if (is_known(place)) continue;
                // Within about a cell of a mark, the surface through it is accurate, and gets a higher weight.
                const double away2 = tree.nearest(place),
                             weight = 1 - (1 - guess_weight) * away2 / (away2 + cell * cell);
                const double off = std::clamp(surface.value(place), -band, band) - double(value);
                value += float(weight * std::clamp(off, -0.5 * band, 0.5 * band));
            }
    });
    return level;
}

/// The errors with which body and guess predict marks from which they were not computed.
class Predictions {
public:
    /// @param shrink  factor by which a finer lattice reduces the body's errors
    Predictions(const HeldOut& held, double cell, double shrink) : small_(kUniformDeviation * cell) {
        const double maximum = kFarthestMiss * cell;
        for (std::size_t n = 0; n < held.of_body.size(); ++n)
            off_.push_back({std::clamp(shrink * held.of_body[n], -maximum, maximum),
                            std::clamp(held.of_guess[n], -maximum, maximum)});
    }

    /// The weight of the guess, in [0,1], for which the weighted mean of guess and body predicts the marks best
    /// (stacking: Wolpert, Neural Networks 5(2), 1992), by the mean absolute error, smoothed about 0, which is
    /// minimized by iteratively reweighted least squares.
    [[nodiscard]] double weight_of_guess() const {
        constexpr int kRounds = 30;
        double weight = 0.5;
        for (int round = 0; round < kRounds; ++round) {
            double with = 0, square = 0;
            for (const auto& [body, guess] : off_) {
                const double off = weight * guess + (1 - weight) * body, apart = body - guess,
                             counts = 1 / std::hypot(off, small_);
                with += counts * body * apart;
                square += counts * apart * apart;
            }
            if (!(square > 0)) return 0;
            weight = std::clamp(with / square, 0.0, 1.0);
        }
        return weight;
    }
    /// The mean squared error of the guess minus that of the body, in standard errors.
    [[nodiscard]] double guess_worse() const {
        double sum = 0, squares = 0;
        for (const auto& [body, guess] : off_) {
            const double more = guess * guess - body * body;
            sum += more;
            squares += more * more;
        }
        return squares > 0 ? sum / std::sqrt(squares) : 0;
    }

private:
    struct Off {
        double body, guess;
    };
    std::vector<Off> off_;
    double small_;
};

double median_size(const std::vector<double>& values) {
    std::vector<double> sizes;
    for (const double v : values) sizes.push_back(std::abs(v));
    return sizes.empty() ? 0.0 : cloud::median(sizes);
}

/// A level set on a lattice as a function of world positions.
class Level {
public:
    Level(const ImageGeometry& geometry, const Lattice& lattice, const Field& field)
        : geometry_(geometry), lattice_(lattice), field_(field) {}

    /// Positions beyond the lattice are outside. If the lattice ends with the image, its last values are continued.
    [[nodiscard]] double operator()(const Vec3& world) const {
        const Vec3 place = to_frame(geometry_, world);
        double beyond = 0;
        for (int a = 0; a < 3; ++a) {
            const double low = lattice_.origin[a], cell = lattice_.spacing[a],
                         high = low + (lattice_.size[a] - 1) * cell;
            if (low > 0.5 * cell) beyond = std::max(beyond, low - place[a]);
            if (high < (geometry_.size[a] - 1) * geometry_.spacing[a] - 0.5 * cell)
                beyond = std::max(beyond, place[a] - high);
        }
        const double inner = lattice_.value(field_, place);
        return beyond > 0 ? std::max(inner, beyond) : inner;
    }

private:
    const ImageGeometry& geometry_;
    const Lattice& lattice_;
    const Field& field_;
};

/// Dice coefficient of two level sets at the lattice's nodes, and volume and area of the second one.
struct Overlap {
    double dice = 0, volume = 0, area = 0;
};
Overlap compare(const FloatGrid& guess, const ImageGeometry& geometry, const Lattice& lattice, const Field& level) {
    const std::vector<double> of_guess = levels_on(lattice, geometry, guess);
    double both = 0, sum = 0, inside = 0, rim = 0;
    const double cell = lattice.finest();
    for (std::size_t n = 0; n < level.size(); ++n) {
        const bool one = of_guess[n] < 0, other = level[n] < 0;
        both += one && other;
        sum += double(one) + double(other);
        inside += other;
        rim += std::abs(double(level[n])) < cell;
    }
    const double volume = lattice.spacing[0] * lattice.spacing[1] * lattice.spacing[2];
    return {sum > 0 ? 2 * both / sum : 0, inside * volume, rim * volume / (2 * cell)};
}

/// Adds positions in the image's frame: at most kInference.guess_marks, as far apart as possible.
void add_places(const ImageGeometry& geometry, const std::vector<Vec3>& world, std::vector<Vec3>& places) {
    if (world.empty()) return;
    for (const std::size_t n : guess::spread_out(world, kInference.guess_marks))
        places.push_back(to_frame(geometry, world[n]));
}

/// Fraction of the marks that lie off a level's surface. The precision of a mark is that of the image along its normal:
/// across thick slices it may lie half a slice off.
double fraction_off(const ImageGeometry& geometry, const std::vector<Vec3>& world, const Solid& body,
                    const Field& level) {
    std::vector<Vec3> places;
    for (const Vec3& mark : world) places.push_back(to_frame(geometry, mark));
    const std::vector<Vec3> normals = normals_of(body, places);
    double off = 0;
    for (std::size_t n = 0; n < places.size(); ++n)
        off += std::abs(body.lattice.value(level, places[n])) >
               kInference.off_cells * body.lattice.extent_along(normals[n]);
    return off / double(places.size());
}

template <typename LevelAt>
std::size_t count_wrong(const KnownSides& sides, const LevelAt& level) {
    const auto wrong = [&](const std::vector<Vec3>& places, double side) {
        return std::size_t(
            std::count_if(places.begin(), places.end(), [&](const Vec3& p) { return side * level(p) < 0; }));
    };
    return wrong(sides.inside, -1) + wrong(sides.outside, 1);
}

/// Increase of the error per distance from the marks: squared errors are fitted by a multiple of squared distances.
double error_slope(const HeldOut& held, double guess_weight, double shrink) {
    double errors = 0, distances = 0;
    for (std::size_t n = 0; n < held.of_body.size(); ++n) {
        const double off = held.of_both(n, guess_weight, shrink);
        errors += off * off * held.to_rest2[n];
        distances += held.to_rest2[n] * held.to_rest2[n];
    }
    return distances > 0 ? std::sqrt(errors / distances) : 0;
}

/// The volume between a surface and the truth, relative to the body, is the surface's area times its mean error divided
/// by the volume. Held-out marks lie on the true surface, and measure the error of a result from fewer marks. The
/// relation of that error to the Dice coefficient was fitted: kInference.expected_scale.
std::optional<ExpectedDice> expected_dice(const HeldOut& held, double guess_weight, double cell, const Overlap& body) {
    if (held.of_body.size() < kCommon.quadric || !(body.volume > 0)) return {};
    constexpr double kMaxCells = 8, kMinCells = 0.1;
    const double maximum = kMaxCells * cell;
    double error = 0;
    for (std::size_t n = 0; n < held.of_body.size(); ++n) {
        error += std::min(std::abs(held.of_both(n, guess_weight)), maximum) / double(held.of_body.size());
    }
    error = std::max(error, kMinCells * cell);
    const double lost =
        kInference.expected_scale * std::pow(error * body.area / body.volume, kInference.expected_power);
    const auto dice = [&](double factor) { return std::max(1 - lost * factor, 0.0); };
    return ExpectedDice{dice(1), dice(kInference.expected_factor), dice(1 / kInference.expected_factor)};
}

}  // namespace

Inferred infer(const FloatGrid& guess, const std::vector<Vec3>& world, const Image& image, const KnownSides& sides,
               const RunContext& run) {
    Inferred result;
    result.marks = world;
    InferenceReport& report = result.report;
    const auto keep_guess = [&](std::string reason) {
        report.reason = std::move(reason);
        result.u = guess.deepCopy();
        return result;
    };
    const ImageGeometry& geometry = image.geometry();
    Marks marks(geometry, world);
    if (marks.places.size() < kCommon.quadric)
        return keep_guess(std::to_string(marks.places.size()) +
                          " marks are too few to learn inside and outside from the image, expected at least " +
                          std::to_string(kCommon.quadric));
    add_places(geometry, sides.inside, marks.inside);
    add_places(geometry, sides.outside, marks.outside);
    Inference inference(image, std::move(marks), run);
    if (is_too_large(inference.coarse_lattice(), geometry, run))
        return keep_guess("the image's box around the marks is too large to be read as a whole");
    with_threads(run, [&] {
        HeldOut held;
        for (int round = 0;; ++round) {
            if (!inference.find(report)) {
                keep_guess("no body is probable given the image");
                return;
            }
            held = inference.hold_out();
            if (round == kCommon.rounds || !inference.leave_out_wrong(held)) break;
        }
        const Solid body = inference.refined();
        const double cell = body.lattice.finest();
        report.held_out = held.of_body.size();
        report.body_error = median_size(held.of_body);
        report.guess_error = median_size(held.of_guess);
        const double shrink = cell / inference.coarse_cell();
        report.weight_of_guess = Predictions(held, cell, shrink).weight_of_guess();
        report.error_slope = error_slope(held, 1, shrink);  // of the guess; replaced if the body is used
        const Field level = inference.pooled(body, report.weight_of_guess);
        std::erase_if(result.marks, [&](const Vec3& mark) {
            const Vec3 place = to_frame(geometry, mark);
            const bool is_wrong = inference.leaves_out(place) && std::abs(body.lattice.value(level, place)) >
                                                                     kInference.off_cells * body.lattice.finest();
            if (is_wrong) report.wrong_marks.push_back(mark);
            return is_wrong;
        });
        const auto reject_body = [&](const char* reason) {  // marks that the body showed as wrong are restored
            report.wrong_marks.clear();
            result.marks = world;
            keep_guess(reason);
        };
        const Overlap overlap = compare(guess, geometry, body.lattice, level);
        report.agreement = overlap.dice;
        report.expected = expected_dice(held, report.weight_of_guess, cell, overlap);
        // If guess and body agree, the guess, which is simpler, is used unless it is significantly worse than the body
        // (the one-standard-error rule: Breiman et al., Classification and Regression Trees, 1984). Otherwise the body
        // is used, unless it is significantly worse than the guess.
        // The comparison uses the measured errors, not those that are extrapolated to a finer lattice.
        const double worse = Predictions(held, cell, 1).guess_worse();
        if (overlap.dice > 1 - kCommon.minority ? worse <= 1 : worse < -2) {
            keep_guess(
                overlap.dice > 1 - kCommon.minority
                    ? "the surface of minimum bending energy agrees with the image, and predicts held-out marks as well"
                    : "the surface of minimum bending energy predicts held-out marks better");
            return;
        }
        if (fraction_off(geometry, result.marks, body, level) > max_fraction_off()) {
            report.expected.reset();
            reject_body("the most probable body given the image misses many marks");
            return;
        }
        const Level at(geometry, body.lattice, level);
        const auto at_guess = [&](const Vec3& place) { return detail::level_at(guess, place); };
        if (count_wrong(sides, at) > count_wrong(sides, at_guess)) {
            reject_body(
                "the most probable body given the image puts fewer of the positions known to be inside or outside on "
                "the right side than the surface of minimum bending energy");
            return;
        }
        result.u = start_from_level(
            domain_of(guess), result.marks,
            [&](const Vec3& from, const Vec3& step, int count, double* values) {
                for (int n = 0; n < count; ++n) values[n] = at(plus(from, n, step));
            },
            run);
        report.error_slope = error_slope(held, report.weight_of_guess, shrink);
        report.used = true;
        report.reason = "computed from marks and image together";
    });
    return result;
}

}  // namespace covol
