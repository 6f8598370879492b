#include "segment/result/report.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/heuristics.h"
#include "cloud/indicator/heuristics.h"
#include "covol/compare.h"
#include "grid/levels_at.h"
#include "image/support.h"
#include "meshing/mesh_distance.h"
#include "points/kd_tree.h"
#include "segment/doubts.h"
#include "segment/heuristics.h"
#include "segment/result/mark_fit.h"

namespace covol::pipeline {
namespace {

/// One position on the surface in each leaf that it crosses.
std::vector<Vec3> places_on(const FloatGrid& surface) {
    std::vector<Vec3> places;
    for (auto leaf = surface.tree().cbeginLeaf(); leaf; ++leaf) {
        float minimum = float(surface.voxelSize()[0]);
        openvdb::Coord at;
        bool found = false;
        for (auto value = leaf->cbeginValueOn(); value; ++value)
            if (std::abs(*value) < minimum) {
                minimum = std::abs(*value);
                at = value.getCoord();
                found = true;
            }
        if (!found) continue;
        const openvdb::Vec3d world = surface.indexToWorld(at);
        places.push_back({world[0], world[1], world[2]});
    }
    return places;
}

/// Warnings about a surface that follow from the marks, and from the image at them.
class Doubts {
public:
    Doubts(const Problem& problem, const Choices& choices, const Solution& solution, const Surface& surface,
           SegmentReport& report, Remarks& remarks)
        : problem_(problem),
          marks_(surface.marks),
          h_(choices.h),
          solution_(solution),
          surface_(surface),
          report_(report),
          remarks_(remarks) {}

    void of_marks() {
        report_.marks_off.beyond = largest_error_of_marks(problem_, h_, solution_.start.cloud.noise);
        for (const std::string& line :
             compare_with_marks(report_, *surface_.level_set, problem_.image, marks_, surface_.mark_distances))
            if (!solution_.start.cloud.fills) warn(line);  // points that fill a solid lie inside its surface
        if (solution_.start.origin == StartOrigin::Guess) find_surface_beyond();
        if (solution_.start.origin == StartOrigin::Cloud) find_folds();
        if (problem_.image == nullptr || !uses_image(solution_.start.flow)) return;
        find_lost_precision();
        find_strange_image();
        find_silent_image();
        find_wrong_marks();
        find_doubtful_body();
    }

    void of_surface() {
        find_pieces();
        find_seeds();
        find_holes();
    }

private:
    void warn(const std::string& line) { remarks_.warn(line, problem_.run); }

    /// The surface of minimum bending energy through the marks may extend far beyond them.
    void find_surface_beyond() {
        const double far = far_from_marks(marks_);
        const std::vector<Vec3> places = places_on(*surface_.level_set);
        const detail::KdTree tree(marks_);
        const auto beyond = std::count_if(places.begin(), places.end(),
                                          [&](const Vec3& place) { return tree.nearest(place) > far * far; });
        const double fraction = double(beyond) / double(std::max<std::size_t>(1, places.size()));
        report_.surface_beyond_marks = fraction;
        if (fraction > kCommon.minority)
            warn(number(std::round(100 * fraction)) + " % of the surface is farther than " + number(far) +
                 " (half of the extent of the marks) from every mark: it extends beyond the marked region; add marks "
                 "there, or give a position outside the body (`outside`)");
    }

    /// Detects folds of the surface that were taken for noise. Noise scatters points in all directions: if the nearest
    /// points lie on sheets although the surface was smoothed for noise, they are folds. The deviation of twelve
    /// neighbouring points from a quadric is 0.11 to 0.247 of their reach in folds, 0.26 or more if the noise is as
    /// large as the distance between nearest points, and 0.33 if they fill a ball.
    void find_folds() {
        const CloudReport& cloud = solution_.start.cloud;
        if (cloud.noise > cloud.nearest && cloud.noise > kDoubts.folded_noise * cloud.near_noise &&
            cloud.near_noise < kCloud.flat * cloud.near_reach)
            warn("the surface is smoothed for a noise of " + number(cloud.noise) +
                 ", but neighbouring points lie on sheets (" + number(cloud.near_noise) + " from them within " +
                 number(cloud.near_reach) +
                 "): folds or walls that are only two or three points apart are lost; sample more densely there");
    }

    /// Image values are processed in single precision, which may not resolve small differences of large values.
    void find_lost_precision() {
        const auto [low, high] = problem_.image->percentiles(0.01, 0.99);
        const double largest = std::max(std::abs(low), std::abs(high));
        const double step = largest * std::numeric_limits<float>::epsilon();
        if (high > low && step > kCommon.negligible * (high - low))
            warn("98 % of the image's values lie between " + number(low) + " and " + number(high) +
                 ", where single precision resolves only steps of " + number(step) + ": subtract an offset first");
    }

    /// Some of the marks, and the surface's normals there.
    struct Normals {
        std::vector<Vec3> places, normals;
    };

    [[nodiscard]] Normals normals_at_marks() const {
        const std::size_t every = std::max<std::size_t>(1, marks_.size() / kCommon.sample);
        std::vector<Vec3> beside;  // two positions for each mark and axis, half a voxel to either side
        for (std::size_t n = 0; n < marks_.size(); n += every)
            for (int a = 0; a < 3; ++a)
                for (const double step : {-0.5, 0.5}) beside.emplace_back(marks_[n])[std::size_t(a)] += step * h_;
        const std::vector<double> levels = detail::levels_at(*surface_.level_set, beside);
        Normals found;
        for (std::size_t n = 0, first = 0; n < marks_.size(); n += every, first += 6) {
            Vec3 normal{};
            for (std::size_t a = 0; a < 3; ++a) normal[a] = levels[first + 2 * a + 1] - levels[first + 2 * a];
            const double length = std::hypot(normal[0], normal[1], normal[2]);
            if (!(length > 0.5 * h_)) continue;  // the mark lies outside of the band
            for (double& c : normal) c /= length;
            found.places.push_back(marks_[n]);
            found.normals.push_back(normal);
        }
        return found;
    }

    /// Marks of another image, channel or coordinate system look valid; only the image shows that they do not fit.
    void find_strange_image() {
        const Normals at = normals_at_marks();
        const detail::ImageSupport support =
            detail::measure_support(*problem_.image, at.places, at.normals, h_, problem_.run);
        if (support.places == 0) return;
        report_.image_support = support.fraction;
        const GuidanceReport& guidance = solution_.guidance;
        const EdgeFeature feature = guidance.used ? guidance.feature.feature : solution_.edges.options.feature;
        const detail::StrongestBorder border = detail::find_strongest_border(
            *problem_.image, at.places, at.normals, h_,
            is_line(feature) ? detail::BorderKind::Line : detail::BorderKind::Slope, problem_.run);
        report_.image_border = {border.at, border.fraction, border.errors};
        // The middle of a wide line is uniform, but the image predicts marks there, too.
        const bool is_unpredicted = solution_.was_requested && guidance.gain < kDoubts.clear_gain;
        if (support.fraction + kCommon.errors * support.error < 0.5 ||
            (is_unpredicted && support.fraction < kDoubts.image_support))
            warn("the image does not show a border at the marks: it varies more there than five voxels away in only " +
                 number(std::round(100 * support.fraction)) +
                 " of 100 pairs, with 50 by chance; check whether the marks belong to this image, channel and "
                 "coordinate system, and have its scale");
    }

    void find_silent_image() {
        if (solution_.was_requested && !solution_.guidance.used && !solution_.start.inference.used)
            warn("the image was not used between the marks: " + solution_.guidance.reason);
    }

    void find_wrong_marks() {
        constexpr std::size_t kNamed = 5;
        const std::vector<Vec3>& wrong = solution_.start.inference.wrong_marks;
        if (wrong.empty()) return;
        std::string places;
        for (std::size_t n = 0; n < std::min(wrong.size(), kNamed); ++n)
            places += (n > 0 ? "; " : "") + place_of(problem_.image, wrong[n]);
        if (wrong.size() > kNamed) places += "; and " + std::to_string(wrong.size() - kNamed) + " more";
        warn(std::to_string(wrong.size()) + " of " + std::to_string(wrong.size() + marks_.size()) +
             " marks are likely wrong and were left out (" + places +
             "): correct or delete them, or add marks near them if a part of the body is missing there");
    }

    void find_doubtful_body() {
        const auto& expected = solution_.start.inference.expected;
        if (!expected || expected->value >= kDoubts.min_expected_dice) return;
        const auto percent = [](double value) { return number(std::round(100 * value) / 100); };
        warn(
            "the body is probably inaccurate: cross-validation on held-out marks predicts a Dice coefficient of "
            "about " +
            percent(expected->value) + " (" + percent(expected->low) + " to " + percent(expected->high) +
            " with a probability of 90 %); add marks, especially where the body is thin or branches");
    }

    void find_pieces() {
        if (solution_.start.origin != StartOrigin::Guess) return;
        const std::size_t marks = solution_.start.guess.marks;
        if (surface_.measures.components > 1)
            warn("the surface through the marks has " + std::to_string(surface_.measures.components) +
                 " pieces: if they are one body, add marks between them; mark several bodies as separate structures");
        if (const int genus = surface_.measures.genus;
            genus > 1 && double(marks) < kDoubts.marks_of_handle * double(genus))
            warn("the surface has " + std::to_string(genus) + " handles with " + std::to_string(marks) +
                 " marks: if the body has no holes, its walls are thinner than the errors of the marks; more "
                 "marks there, or more precise ones, close the holes");
    }

    void find_seeds() {
        report_.seeds = check_seeds(*surface_.level_set, problem_.options.inside, problem_.options.outside);
        report_.seeds.painted = problem_.options.painted_seeds;
        if (const std::string warning = report_.seeds.warning(); !warning.empty())
            warn((report_.seeds.painted > 0 ? "paint: " : "seeds: ") + warning);
    }

    void find_holes() {
        const HolesReport& holes = surface_.holes;
        // With the policy Open, the surface ends where the points end, so that no part of it is without points.
        if (surface_.fraction_without_points <= kCommon.negligible || holes.policy == Holes::Open) return;
        warn(number(std::round(1000 * surface_.fraction_without_points) / 10) + " % of the surface is farther than " +
             number(holes.distance) + " from every point: " +
             (holes.policy == Holes::Flat ? "flat patches close it there" : "only curvature determines it there"));
    }

    const Problem& problem_;
    const std::vector<Vec3>& marks_;
    const double h_;
    const Solution& solution_;
    const Surface& surface_;
    SegmentReport& report_;
    Remarks& remarks_;
};

Start resolved_start(StartMethod method, const Start& requested) {
    switch (method) {
        case StartMethod::Guess: return GuessStart{};
        case StartMethod::Cloud: return CloudStart{};
        case StartMethod::Tagged: return TagStart{};
        case StartMethod::Corrected:
        case StartMethod::Seeds:
        case StartMethod::Named: break;
    }
    return requested;
}

}  // namespace

SegmentOptions resolved_options(const Problem& problem, const Choices& choices, const Solution& solution) {
    SegmentOptions used = problem.options;
    used.voxel_size = choices.h;
    used.start = resolved_start(choices.start, used.start);
    used.evolve = solution.start.flow;
    used.edge = solution.edges.options;
    used.tag_distance = solution.start.tag_distance ? solution.start.tag_distance : used.tag_distance;
    used.coarse_levels = solution.coarse_levels;
    used.correction = solution.start.correction_options;
    return used;
}

SegmentReport measure(const Problem& problem, const Choices& choices, const StepReport& before,
                      const Solution& solution, const Surface& surface) {
    const StartFacts& start = solution.start;
    SegmentReport report;
    StepReport steps = before;
    for (const StepReport* step : {&start.report, &solution.report, &surface.report}) steps.add(*step);
    report.coarse = solution.coarse;
    report.domain = start.domain;
    report.active_voxels = surface.active_voxels;
    report.leaf_count = surface.leaf_count;
    report.point_count = problem.given.size();
    if (const auto& contours = problem.options.contours)
        report.densified = contours->along.size() + contours->between.size();
    report.guess = start.guess;
    report.cloud = start.cloud;
    report.inference = start.inference;
    report.guidance = solution.guidance;
    report.tag = start.tag;
    report.band = start.band;
    report.edge = solution.edges.found;
    report.solve = solution.solve;
    report.solve.active_voxels = surface.active_voxels;
    report.solve.leaf_count = surface.leaf_count;
    report.surface = surface.measures;
    report.mesh = surface.mesh_report;
    report.correction = start.correction_report;
    report.fraction_without_points = surface.fraction_without_points;
    report.holes = surface.holes;
    report.resolved = resolved_options(problem, choices, solution);
    {
        const Timed timed(steps.seconds.surface);
        Doubts doubts(problem, choices, solution, surface, report, steps.remarks);
        if (!surface.mark_distances.empty()) {
            report.fit = detail::statistics_of(surface.mark_distances);
            doubts.of_marks();
        }
        doubts.of_surface();
    }
    report.seconds = steps.seconds;
    std::move(steps.remarks).move_to(report);
    return report;
}

}  // namespace covol::pipeline
