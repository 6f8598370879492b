#include "covol/guess.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <utility>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "clip/clipped.h"
#include "clip/half_spaces.h"
#include "covol/start.h"
#include "guess/guess_in_image.h"
#include "guess/heuristics.h"
#include "guess/marks_surface.h"
#include "points/kd_tree.h"

namespace covol {
namespace {

/// The options, with the half-spaces that cut the body. They replace GuessOptions::end, which is a box along the
/// world's axes and cannot describe a rotated image.
struct InImage : GuessOptions {
    InImage(const GuessOptions& options, Clip clip) : GuessOptions(options), faces(std::move(clip)) {}
    Clip faces;
};

double longest(const std::array<Vec3, 3>& axes) {
    double maximum = 0;
    for (const Vec3& a : axes) maximum = std::max(maximum, length(a));
    return maximum;
}

/// The standard deviation of a mark's position along a unit vector, world units.
double deviation_along(const InImage& options, const Vec3& direction) {
    double sd = 0;
    for (const Vec3& a : options.deviation) sd = std::hypot(sd, dot(a, direction));
    return sd;
}

/// A face to which the mark is so close that it may have been set on the cut surface instead of the body's own surface;
/// null if there is none.
const HalfSpace* end_beside(const Vec3& mark, const InImage& options) {
    for (const HalfSpace& face : options.faces) {
        // `near` covers the error of the mark, and the half voxel between the centre of the last slice and the image's
        // end.
        const double near = kCommon.errors * deviation_along(options, face.normal);
        if (detail::along(face, mark) > -near) return &face;
    }
    return nullptr;
}

guess::ImpreciseMarks imprecise(const std::vector<Vec3>& marks, const InImage& options) {
    guess::ImpreciseMarks result;
    result.marks = marks;
    result.deviation = options.deviation;
    if (const double stated = longest(options.deviation); options.max_deviation > stated && stated > 0)
        result.max_factor = options.max_deviation * options.max_deviation / (stated * stated);
    result.world = options.faces;
    // If marks were left out, it is unknown to which marks the normals belong.
    if (options.normals.size() == marks.size()) result.normals = options.normals;
    return result;
}

/// For each seed on the wrong side of the surface, adds the constraint that the value there is that of a position
/// slightly inside (or outside) of the surface.
/// @return whether constraints were added
bool add_seed_constraints(const guess::MarksSurface& surface, const InImage& options, guess::ImpreciseMarks& known) {
    const double beyond = longest(options.deviation) / kUniformDeviation;
    bool any = false;
    const auto hold = [&](const std::vector<Vec3>& seeds, double side) {
        for (const Vec3& seed : seeds) {
            if (side * surface.value(seed) > 0) continue;
            known.seeds.push_back(seed);
            known.seed_value.push_back(side * beyond);
            any = true;
        }
    };
    hold(options.inside, -1);
    hold(options.outside, 1);
    return any;
}

/// The positions of guess::points_around(), without those that the faces cut off.
std::vector<Vec3> places_around(const std::vector<Vec3>& marks, double times, const InImage& options) {
    std::vector<Vec3> places = guess::points_around(marks, times);
    std::erase_if(places, [&](const Vec3& place) { return detail::depth_in(options.faces, place) > 0; });
    return places;
}

/// If the surface extends far beyond its marks, adds the constraint that positions around the marks are outside; the
/// value there is the distance to the nearest mark. Without these constraints, the surface of minimum energy through
/// few or rough marks may extend through the whole space and never close.
/// @return whether constraints were added
bool add_outside_constraints(const guess::MarksSurface& surface, const InImage& options, guess::ImpreciseMarks& known) {
    const std::vector<Vec3> far = places_around(known.marks, 2 * kGuess.held_at, options);
    if (std::all_of(far.begin(), far.end(), [&](const Vec3& place) { return surface.value(place) > 0; })) return false;
    const detail::KdTree tree(known.marks);
    for (const Vec3& place : places_around(known.marks, kGuess.held_at, options)) {
        known.seeds.push_back(place);
        known.seed_value.push_back(std::sqrt(tree.nearest(place)));
    }
    return true;
}

std::size_t count_wrong(const guess::MarksSurface& surface, const InImage& options) {
    std::size_t wrong = 0;
    for (const Vec3& seed : options.inside) wrong += !(surface.value(seed) < 0);
    for (const Vec3& seed : options.outside) wrong += !(surface.value(seed) > 0);
    return wrong;
}

/// The marks, grouped by the face that end_beside() finds for them (null: no face), each group in the order of `marks`.
std::map<const HalfSpace*, std::vector<Vec3>> by_face(const std::vector<Vec3>& marks, const InImage& options) {
    std::map<const HalfSpace*, std::vector<Vec3>> found;
    for (const Vec3& mark : marks) found[end_beside(mark, options)].push_back(mark);
    return found;
}

/// Whether the nearest marks lie on all sides of `mark`: the angle between the directions to two successive ones, in
/// the plane of the face, is always clearly less than pi, its value at a straight border of an area with marks.
bool is_surrounded(const Vec3& mark, const std::vector<Vec3>& others, const HalfSpace& face) {
    const auto [u, v] = detail::directions_in(face);
    std::vector<std::array<double, 2>> around;  // of the other marks: squared distance and angle, in the face's plane
    for (const Vec3& other : others) {
        const Vec3 to = minus(other, mark);
        const double x = dot(to, u), y = dot(to, v);
        if (x != 0 || y != 0) around.push_back({x * x + y * y, std::atan2(y, x)});
    }
    const std::size_t count = std::min(kCommon.ring, around.size());
    std::partial_sort(around.begin(), around.begin() + std::ptrdiff_t(count), around.end());
    std::vector<double> directions;
    for (std::size_t n = 0; n < count; ++n) directions.push_back(around[n][1]);
    std::sort(directions.begin(), directions.end());
    double gap =
        directions.empty() ? 2 * std::numbers::pi : directions.front() + 2 * std::numbers::pi - directions.back();
    for (std::size_t n = 1; n < directions.size(); ++n) gap = std::max(gap, directions[n] - directions[n - 1]);
    return gap < (1 - kCommon.minority) * std::numbers::pi;
}

/// Whether the marks beside a face lie along a closed line instead of all over an area. They are then the outline of
/// the cut, which belongs to the surface of the body, and are kept regardless of the other marks.
bool is_outline(const std::vector<Vec3>& marks, const HalfSpace& face) {
    if (marks.size() < kCommon.ring) return false;
    const auto surrounded =
        std::count_if(marks.begin(), marks.end(), [&](const Vec3& mark) { return is_surrounded(mark, marks, face); });
    // If twelve or more marks are distributed over an area, at least a sixth of them are surrounded, which exceeds
    // kCommon.minority.
    return double(surrounded) < kCommon.minority * double(marks.size());
}

/// Distance of a mark from the outline of the body's section, within the plane of the cut, world units; negative
/// inside. It is estimated as the body's value divided by its slope in that plane.
double within_section(const guess::MarksSurface& body, const Vec3& mark, const HalfSpace& cut, const InImage& options) {
    double slope = 0;
    for (const Vec3& direction : detail::directions_in(cut)) {
        const double step = std::max(deviation_along(options, direction), 1e-12);
        const Vec3 low = detail::moved(mark, direction, -step), high = detail::moved(mark, direction, step);
        slope = std::hypot(slope, (body.value(high) - body.value(low)) / (2 * step));
    }
    return body.value(mark) / std::max(slope, kCommon.negligible);
}

/// Removes the marks on a cut that lie inside the section of the body, because these are not on the surface of the
/// body. The body is computed from the other marks.
std::vector<Vec3> without_cut_marks(const std::vector<Vec3>& marks, const InImage& options, const RunContext& run) {
    if (options.faces.empty()) return marks;
    std::vector<Vec3> sure, doubtful;
    std::set<const HalfSpace*> all_over;
    for (const auto& [face, of_face] : by_face(marks, options))
        if (face != nullptr && !is_outline(of_face, *face)) all_over.insert(face);
    for (const Vec3& mark : marks) (all_over.contains(end_beside(mark, options)) ? doubtful : sure).push_back(mark);
    if (doubtful.empty() || sure.size() < kCommon.ring || !guess::span_space(sure)) return marks;
    std::vector<Vec3> held = sure, before;
    for (int round = 0; round < kCommon.rounds && held != before;
         ++round) {  // marks that are added near the section's outline make the next round's body more accurate
        const guess::MarksSurface body(imprecise(held, options), run);
        before = std::exchange(held, sure);
        for (const Vec3& mark : doubtful) {
            const HalfSpace& cut = *end_beside(mark, options);
            double deviation = 0;
            for (const Vec3& direction : detail::directions_in(cut))
                deviation = std::max(deviation, deviation_along(options, direction));
            if (within_section(body, mark, cut, options) > -kCommon.errors * deviation) held.push_back(mark);
        }
    }
    return held;
}

}  // namespace

bool can_enclose(const std::vector<Vec3>& marks) { return guess::span_space(marks); }

Guess guess_from_marks(const Domain& domain, const std::vector<Vec3>& marks, const GuessOptions& options,
                       const RunContext& run) {
    return guess::guess_in_image(domain, marks, options, options.end ? make_clip(*options.end) : Clip{}, run);
}

Guess guess::guess_in_image(const Domain& domain, const std::vector<Vec3>& marks, const GuessOptions& given,
                            const Clip& image, const RunContext& run) {
    const InImage options(given, image);
    require_valid<GuessOptions>(options, "guess");
    Guess result;
    GuessReport& report = result.report;
    with_threads(run, [&] {
        result.marks = without_cut_marks(marks, options, run);
        guess::ImpreciseMarks known = imprecise(result.marks, options);
        report.marks = result.marks.size();
        report.cut_marks = marks.size() - result.marks.size();
        auto surface = std::make_unique<guess::MarksSurface>(known, run);
        report.held_around = add_outside_constraints(*surface, options, known);
        if (report.held_around) surface = std::make_unique<guess::MarksSurface>(known, run);
        for (int round = 0; round < kCommon.rounds && add_seed_constraints(*surface, options, known); ++round)
            surface = std::make_unique<guess::MarksSurface>(known, run);
        report.patches = surface->patches();
        report.wrong_seeds = count_wrong(*surface, options);
        result.u = start_from_level(
            domain, result.marks,
            [&](const Vec3& from, const Vec3& step, int count, double* values) {
                surface->row(from, step, count, values);
            },
            run);
    });
    report.summary = std::to_string(report.marks) + " marks, the surface of minimum bending energy through them";
    if (report.patches > 0) report.summary += ", in " + std::to_string(report.patches) + " overlapping parts";
    if (report.held_around) report.summary += ", prevented from extending beyond them";
    if (report.cut_marks > 0)
        report.summary +=
            "; " + std::to_string(report.cut_marks) + " further marks lie in the cut at the end of the image";
    return result;
}

}  // namespace covol
