#include "inference/candidate.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "covol/domain.h"
#include "covol/error.h"
#include "covol/guess.h"
#include "inference/heuristics.h"
#include "inference/minimal_surface.h"
#include "points/kd_tree.h"

namespace covol::inference {
namespace {

using guess::Constraints;
using guess::Normals;
using guess::Search;
using guess::VariationalSurface;

constexpr double kOffsets[] = {0.75, 1.5, 2.5, 3.5};  // distance from a mark, cells
constexpr int kAllFolds = -1;                         // fold of a sample that is never left out
constexpr std::size_t kElsewhere = 300;               // maximum number of samples for each call of add_nodes()
// Maximum number of training marks in addition to Marks::spread: the 78 terms of the regression are fitted as well with
// these as with all marks, in a fraction of the time.
constexpr std::size_t kMarksBesideSpread = 300;
constexpr std::size_t kFewestSamples = 40;
constexpr int kIterations = 150;  // maximum number in minimize_surface(), which usually converges earlier

template <typename Visit>
void for_each_row(const Lattice& lattice, const Visit& visit) {
    tbb::parallel_for(0, lattice.size[2], [&](int k) {
        for (int j = 0; j < lattice.size[1]; ++j) visit(j, k);
    });
}

std::vector<Vec3> at(const std::vector<Vec3>& all, const std::vector<std::size_t>& chosen) {
    std::vector<Vec3> some;
    for (const std::size_t n : chosen) some.push_back(all[n]);
    return some;
}

Constraints constraints_of(const Marks& marks, const std::vector<std::size_t>& chosen, const Proposal& proposal) {
    Constraints c;
    c.marks = at(marks.places, chosen);
    c.variance.assign(chosen.size(), marks.variance);
    if (!proposal.axes.empty()) c.axes = at(proposal.axes, chosen);
    return c;
}

/// The surface through marks, oriented so that the unbounded side is outside.
class GuessedSurface {
public:
    GuessedSurface(const Marks& marks, const std::vector<std::size_t>& chosen, const Proposal& proposal)
        : surface_(constraints_of(marks, chosen, proposal),
                   proposal.search == Search::Near ? at(proposal.axes, chosen) : Normals{}, proposal.search,
                   proposal.amplitude) {
        Vec3 middle{0, 0, 0};
        for (const Vec3& m : marks.places) middle = plus(middle, 1.0 / double(marks.places.size()), m);
        double reach = 0, far = 0;
        for (const Vec3& m : marks.places) reach = std::max(reach, length(minus(m, middle)));
        for (int corner = 0; corner < 8; ++corner)
            far += surface_.value({middle[0] + ((corner & 4) != 0 ? 3 : -3) * reach,
                                   middle[1] + ((corner & 2) != 0 ? 3 : -3) * reach,
                                   middle[2] + ((corner & 1) != 0 ? 3 : -3) * reach});
        side_ = far < 0 ? -1 : 1;
    }
    /// A surface through the `chosen` marks, with normals near those of `whole`, a surface through more marks.
    GuessedSurface(const Marks& marks, const std::vector<std::size_t>& chosen, const Proposal& proposal,
                   const GuessedSurface& whole, const std::vector<Vec3>& normals)
        : surface_(constraints_of(marks, chosen, proposal), at(normals, chosen), Search::Near,
                   whole.surface_.amplitude()) {}

    [[nodiscard]] double amplitude() const { return surface_.amplitude(); }
    [[nodiscard]] double value(const Vec3& place) const { return side_ * surface_.value(place); }
    [[nodiscard]] Vec3 normal(const Vec3& place) const { return times(side_, unit(surface_.gradient(place))); }
    void row(const Vec3& from, const Vec3& step, std::vector<double>& values) const {
        surface_.row(from, step, int(values.size()), values.data());
        for (double& v : values) v *= side_;
    }

private:
    VariationalSurface surface_;
    double side_ = 1;
};

/// The guess as two features: its value, and its value reduced with increasing distance from the marks from which
/// it was computed.
void add_guess(double value, double to_mark, double cell, Features& features) {
    constexpr double kFarCells = 8, kFading = 0.3;
    const double cells = value / cell;
    features[kOfImage] = float(std::clamp(cells, -kFarCells, kFarCells));
    features[kOfImage + 1] = float(std::clamp(cells / (1 + kFading * to_mark / cell), -kFarCells, kFarCells));
}

/// The training samples for inside and outside.
class Samples {
public:
    Samples(const Scene& scene, const GuessedSurface& whole)
        : scene_(scene), whole_(whole), cell_(scene.lattice.finest()) {}

    /// Adds samples along the normals of the marks, each with the value of a guess that was computed without the mark.
    void add_marks(const Proposal& proposal) {
        const Marks& marks = scene_.marks;
        std::vector<Vec3> normals(marks.places.size());
        tbb::parallel_for(std::size_t(0), normals.size(),
                          [&](std::size_t n) { normals[n] = whole_.normal(marks.places[n]); });
        std::vector<std::optional<Held>> held(kFolds);
        tbb::parallel_for(0, kFolds, [&](int fold) {
            std::vector<std::size_t> rest;
            for (std::size_t n = 0; n < marks.spread.size(); ++n)
                if (int(n % kFolds) != fold) rest.push_back(marks.spread[n]);
            try {
                held[std::size_t(fold)].emplace(GuessedSurface(marks, rest, proposal, whole_, normals),
                                                detail::KdTree(at(marks.places, rest)));
            } catch (const Error&) {  // without a surface through the other folds, this one gets no samples
            }
        });
        const detail::KdTree tree(at(marks.places, marks.spread));
        std::size_t rank = 0, others = 0;
        const std::size_t stride = (marks.places.size() - marks.spread.size()) / kMarksBesideSpread + 1;
        for (std::size_t n = 0; n < marks.places.size(); ++n) {
            const bool is_spread = rank < marks.spread.size() && marks.spread[rank] == n;
            if (!is_spread && others++ % stride != 0) continue;
            const std::optional<Held>* one = is_spread ? &held[rank++ % kFolds] : nullptr;
            if (one != nullptr && !*one) continue;
            const double step = scene_.lattice.cell_along(normals[n]);
            for (const double offset : kOffsets)
                for (const double direction : {-1.0, 1.0}) {
                    const Vec3 place = plus(marks.places[n], direction * offset * step, normals[n]);
                    const double guess = whole_.value(place);
                    if (guess * direction < 0) continue;  // `place` is beyond the opposite wall of a thin body
                    Sample s = sample(place);
                    if (one != nullptr)
                        add_guess((*one)->guess.value(place), std::sqrt((*one)->tree.nearest(place)), cell_, s.at);
                    else
                        add_guess(guess, std::sqrt(tree.nearest(place)), cell_, s.at);
                    s.inside = direction < 0;
                    s.fold = int(n % kFolds);
                    all_.push_back(s);
                }
        }
        of_marks_ = all_.size();
    }

    /// Adds nodes whose side is known; their total weight is half of that of the samples at marks.
    void add_nodes(const std::vector<std::size_t>& nodes, bool inside) {
        const std::vector<std::size_t> some = some_of(nodes, kElsewhere);
        for (const std::size_t n : some) {
            const Vec3 place = scene_.lattice.place_of(n);
            Sample s = sample(place);
            add_guess(whole_.value(place), double(scene_.to_mark[n]), cell_, s.at);
            s.inside = inside;
            s.fold = kAllFolds;
            s.weight = float(0.5 * double(of_marks_) / double(some.size()));
            all_.push_back(s);
        }
    }

    [[nodiscard]] std::size_t of_marks() const { return of_marks_; }
    [[nodiscard]] const std::vector<Sample>& all() const { return all_; }

private:
    struct Held {
        GuessedSurface guess;
        detail::KdTree tree;
    };
    [[nodiscard]] Sample sample(const Vec3& place) const {
        Sample s;
        for (int f = 0; f < kOfImage; ++f)
            s.at[std::size_t(f)] = float(scene_.lattice.value((*scene_.image)[f], place));
        return s;
    }

    const Scene& scene_;
    const GuessedSurface& whole_;
    double cell_;
    std::vector<Sample> all_;
    std::size_t of_marks_ = 0;
};

std::vector<std::size_t> surely_outside(const Scene& scene) {
    const double above = kInference.above_hull * scene.marks.spacing + scene.lattice.finest();
    std::vector<std::size_t> nodes;
    for (std::size_t n = 0; n < scene.above_hull.size(); ++n)
        if (double(scene.above_hull[n]) > above) nodes.push_back(n);
    return nodes;
}

/// Log odds of inside at all nodes.
Field odds_of(const Scene& scene, const GuessedSurface& guess, const Appearance& appearance, const Solid* refine) {
    const Lattice& lattice = scene.lattice;
    const double maximum = kInference.max_odds, cell = lattice.finest();
    Field coarse;
    if (refine != nullptr) coarse = signed_distance(refine->lattice, refine->inside);
    Field odds(lattice.count());
    for_each_row(lattice, [&](int j, int k) {
        std::vector<double> row(std::size_t(lattice.size[0]));
        guess.row(lattice.place(0, j, k), {lattice.spacing[0], 0, 0}, row);
        for (int i = 0; i < lattice.size[0]; ++i) {
            const std::size_t n = lattice.node(i, j, k);
            Features at = scene.image->at(n);
            add_guess(row[std::size_t(i)], double(scene.to_mark[n]), cell, at);
            const double above =
                std::max(0.0, double(scene.above_hull[n]) / scene.marks.spacing - kInference.above_hull);
            double value = std::clamp(appearance.log_odds(at), -maximum, maximum);
            value = std::max(value - maximum * above, -maximum);  // inside is less probable with height above the hull
            if (refine != nullptr) {
                const double off = refine->lattice.value(coarse, lattice.place(i, j, k)) / refine->lattice.finest();
                if (std::abs(off) > kHalfWidthVoxels) value = off < 0 ? maximum : -maximum;
            }
            odds[n] = float(value);
        }
    });
    for (const std::size_t n : scene.known_inside) odds[n] = float(kKnown * maximum);
    for (const std::size_t n : scene.known_outside) odds[n] = float(-kKnown * maximum);
    return odds;
}

Solid min_body(const Scene& scene, const Field& odds, const RunContext& run) {
    const Lattice& lattice = scene.lattice;
    const double reach = std::hypot(scene.marks.spacing, lattice.finest());
    Field cost(odds.size()), weight(odds.size()), u(odds.size());
    for (std::size_t n = 0; n < odds.size(); ++n) {
        cost[n] = float(-kInference.odds_weight) * odds[n];
        weight[n] = scene.edge[n] * float(double(scene.to_mark[n]) / reach);
        u[n] = cost[n] < 0 ? 1.0F : 0.0F;
    }
    // At known positions surface costs nothing, so that a small region is not smoothed away.
    for (const std::vector<std::size_t>* nodes : {&scene.known_inside, &scene.known_outside})
        for (const std::size_t n : *nodes) weight[n] = 0;
    return solve_body(lattice, weight, cost, std::move(u), run);
}

/// Drops each part of the solid with less than the fraction kCommon.minority of those of the solid's nodes that are
/// near marks. The solid becomes empty if no node, or every node, is inside.
void keep_marked_parts(const Scene& scene, Solid& solid) {
    const Parts parts = label_parts(solid.lattice, solid.inside);
    std::vector<double> marked(std::size_t(parts.count) + 1, 0.0);
    double all = 0;
    for (std::size_t n = 0; n < solid.inside.size(); ++n) {
        if (parts.number[n] == 0 || double(scene.to_mark[n]) >= kInference.off_cells * solid.lattice.finest()) continue;
        ++marked[std::size_t(parts.number[n])];
        ++all;
    }
    std::size_t inside = 0;
    for (std::size_t n = 0; n < solid.inside.size(); ++n) {
        if (marked[std::size_t(parts.number[n])] < kCommon.minority * std::max(all, 1.0)) solid.inside[n] = 0;
        inside += std::size_t(solid.inside[n] != 0);
    }
    if (inside == 0 || inside == solid.inside.size()) solid.inside.clear();
}

/// Area of the smooth surface of a solid, world units^2, estimated from the faces between cells inside and outside.
double area_of(const Solid& solid) {
    constexpr double kStairs = 1.5;  // mean ratio of the area of cell faces to that of a smooth surface
    const Lattice& lattice = solid.lattice;
    const std::size_t steps[3] = {1, std::size_t(lattice.size[0]),
                                  std::size_t(lattice.size[0]) * std::size_t(lattice.size[1])};
    double area = 0;
    for (int k = 0; k < lattice.size[2]; ++k)
        for (int j = 0; j < lattice.size[1]; ++j)
            for (int i = 0; i < lattice.size[0]; ++i) {
                const std::size_t n = lattice.node(i, j, k);
                if (solid.inside[n] == 0) continue;
                const int here[3] = {i, j, k};
                for (int a = 0; a < 3; ++a) {
                    const double face = lattice.spacing[(a + 1) % 3] * lattice.spacing[(a + 2) % 3];
                    if (here[a] > 0 && solid.inside[n - steps[a]] == 0) area += face;
                    if (here[a] + 1 < lattice.size[a] && solid.inside[n + steps[a]] == 0) area += face;
                }
            }
    return area / kStairs;
}

/// The score of a solid: the log likelihood of a mark, plus the bits that the image gives about the two sides of
/// held-out marks. Marks are assumed to be uniformly distributed on the surface, so that the likelihood decreases with
/// the surface's area and with the distances of the marks from it.
double score_of(const Scene& scene, const Solid& solid, double bits) {
    const double cell = solid.lattice.finest();
    const Field distance = signed_distance(solid.lattice, solid.inside);
    double off = 0;
    for (const Vec3& mark : scene.marks.places)
        off += std::min(std::abs(solid.lattice.value(distance, mark)) / cell, kFarthestMiss);
    return bits - std::log(area_of(solid)) - off / (kUniformDeviation * double(scene.marks.places.size()));
}

}  // namespace

Scene::Scene(const Image& source, const Lattice& given, const Marks& known, const RunContext& run)
    : marks(known), lattice(given), image(std::make_shared<ImageFeatures>(lattice, sample(source, lattice, run))) {
    measure();
}

Scene::Scene(const Scene& other, const Marks& known) : marks(known), lattice(other.lattice), image(other.image) {
    measure();
}

void Scene::measure() {
    to_mark.resize(lattice.count());
    edge = image->edge(lattice, marks.places);
    above_hull.resize(lattice.count());
    const detail::KdTree tree(marks.places);
    for_each_row(lattice, [&](int j, int k) {
        for (int i = 0; i < lattice.size[0]; ++i) {
            const std::size_t n = lattice.node(i, j, k);
            const Vec3 place = lattice.place(i, j, k);
            to_mark[n] = float(std::sqrt(tree.nearest(place)));
            above_hull[n] = float(std::max(marks.above_hull(place), -1e30));
        }
    });
    const std::vector<KnownBall> balls = known_balls(marks, lattice.finest());
    if (balls.empty()) return;
    for (std::size_t n = 0; n < lattice.count(); ++n)
        for (const KnownBall& ball : balls)
            if (length(minus(lattice.place_of(n), ball.middle)) <= ball.radius)
                (ball.inside ? known_inside : known_outside).push_back(n);
}

Solid solve_body(const Lattice& lattice, const Field& weight, const Field& cost, Field u, const RunContext& run) {
    minimize_surface(lattice, weight, cost, kIterations, u, run);
    Solid solid{lattice, std::vector<char>(u.size())};
    for (std::size_t n = 0; n < u.size(); ++n) solid.inside[n] = u[n] > 0.5F ? 1 : 0;
    return solid;
}

Field Solid::level() const {
    constexpr double kCells = 0.7;  // standard deviation that smooths the steps between cells
    return smooth(lattice, signed_distance(lattice, inside), kCells * lattice.finest());
}

std::vector<KnownBall> known_balls(const Marks& marks, double cell) {
    const detail::KdTree tree(marks.places);
    std::vector<KnownBall> balls;
    for (const bool inside : {true, false})
        for (const Vec3& place : inside ? marks.inside : marks.outside)
            balls.push_back({place, std::max(0.5 * std::sqrt(tree.nearest(place)), cell), inside});
    return balls;
}

Candidate propose(const Scene& scene, const Proposal& proposal, const RunContext& run) {
    Candidate candidate;
    candidate.solid.lattice = scene.lattice;
    std::optional<GuessedSurface> guess;
    try {
        guess.emplace(scene.marks, scene.marks.spread, proposal);
    } catch (const Error& error) {
        if (error.code() == Errc::Cancelled) throw;
        return candidate;  // there is no surface with these normals, and thus no body
    }
    candidate.amplitude = guess->amplitude();
    Samples samples(scene, *guess);
    samples.add_marks(proposal);
    if (samples.of_marks() < kFewestSamples) return candidate;
    samples.add_nodes(surely_outside(scene), false);
    samples.add_nodes(scene.known_outside, false);
    samples.add_nodes(scene.known_inside, true);
    if (proposal.is_compared) candidate.bits = held_out_bits(samples.all(), kFolds);
    const Appearance appearance(samples.all());
    run.check();
    Solid solid = min_body(scene, odds_of(scene, *guess, appearance, proposal.refine), run);
    keep_marked_parts(scene, solid);
    if (!solid.empty() && proposal.is_compared) candidate.score = score_of(scene, solid, candidate.bits);
    candidate.solid = std::move(solid);
    return candidate;
}

std::vector<Vec3> image_axes(const Scene& scene, double sigma_cells) {
    const Lattice& lattice = scene.lattice;
    const Field smoothed = smooth(lattice, scene.image->image(), sigma_cells * lattice.finest());
    std::array<Field, 3> slope;
    for (int a = 0; a < 3; ++a) slope[std::size_t(a)] = derivative(lattice, smoothed, a);
    std::vector<Vec3> axes;
    for (const Vec3& mark : scene.marks.places) {
        Vec3 g;
        for (int a = 0; a < 3; ++a) g[a] = lattice.value(slope[std::size_t(a)], mark);
        axes.push_back(length(g) > 0 ? unit(g) : Vec3{1e-3, 0, 0});
    }
    return axes;
}

std::vector<Vec3> normals_of(const Solid& solid, const std::vector<Vec3>& places) {
    const Lattice& lattice = solid.lattice;
    Field body(solid.inside.size());
    for (std::size_t n = 0; n < body.size(); ++n) body[n] = solid.inside[n] != 0 ? -1.0F : 0.0F;
    body = smooth(lattice, body, lattice.finest());
    std::array<Field, 3> slope;
    for (int a = 0; a < 3; ++a) slope[std::size_t(a)] = derivative(lattice, body, a);
    std::vector<Vec3> normals;
    for (const Vec3& place : places) {
        Vec3 g;
        for (int a = 0; a < 3; ++a) g[a] = lattice.value(slope[std::size_t(a)], place);
        normals.push_back(length(g) > 1e-9 ? unit(g) : Vec3{1, 0, 0});
    }
    return normals;
}

VariationalSurface surface_near(const Marks& marks, const std::vector<Vec3>& normals, double amplitude) {
    return {constraints_of(marks, marks.spread, {}), at(normals, marks.spread), Search::Near, amplitude};
}

}  // namespace covol::inference
