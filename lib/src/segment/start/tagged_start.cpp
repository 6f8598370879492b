// The start from the points alone.
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/heuristics.h"
#include "clip/open_ends.h"
#include "covol/distance.h"
#include "covol/error.h"
#include "covol/guess.h"
#include "covol/start.h"
#include "holes/heuristics.h"
#include "inference/heuristics.h"
#include "segment/solve/fields.h"
#include "segment/solve/vanished.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

void append(const std::vector<Vec3>& more, std::vector<Vec3>& all) { all.insert(all.end(), more.begin(), more.end()); }

/// Tags the points of one problem.
struct Tagger {
    const Problem& problem;
    double h;
    std::vector<Vec3> exterior;  ///< seeds that the caller declares to be farther than D from all points
    std::vector<Vec3> outside;   ///< seeds that may lie arbitrarily close to the surface

    [[nodiscard]] std::vector<Vec3> all_seeds() const {
        std::vector<Vec3> seeds = exterior;
        append(outside, seeds);
        return seeds;
    }

    /// The exterior seeds, which tag_interior() checks, and the outside seeds that are farther than D from the points.
    /// Outside seeds in narrower holes are left out.
    [[nodiscard]] std::vector<Vec3> seeds_beyond(double D, const FloatGrid& distance, const Domain& domain) const {
        std::vector<Vec3> seeds = exterior;
        const auto d_at = distance.getConstAccessor();
        for (const Vec3& seed : outside) {
            const Vec3 at = domain.world_to_index(seed);
            if (d_at.getValue(openvdb::Coord::round(openvdb::Vec3d(at[0], at[1], at[2]))) > D) seeds.push_back(seed);
        }
        return seeds;
    }

    [[nodiscard]] TagDistanceChoice choose(const std::vector<Vec3>& points, const Domain& domain) const {
        return choose_tag_distance(points, domain, all_seeds(), problem.run);
    }

    [[nodiscard]] BandResult tag(const std::vector<Vec3>& points, const Domain& domain, double D) const {
        const FloatGridPtr d = compute_distance(points, domain, {D + band_slack(h)}, problem.run).grid;
        return tag_interior(*d, {D, all_seeds()}, problem.run);
    }
};

// ---- bodies that the image cuts off -------------------------------------------------------------------------------

/// A domain on the same lattice that contains all points, extended by a margin in world units.
Domain around(Domain domain, const std::vector<Vec3>& points, double margin) {
    const WorldBox box = bounding_box(points);
    const Vec3 low = domain.world_to_index(box.min), high = domain.world_to_index(box.max);
    for (int a = 0; a < 3; ++a) {
        domain.min[a] = std::min(domain.min[a], int(std::floor(low[a])));
        domain.max[a] = std::max(domain.max[a], int(std::ceil(high[a])));
    }
    return widened(domain, int(std::ceil(margin / domain.voxel_size)));
}

/// A tagged body that extends beyond the image.
struct CutBody {
    std::vector<Vec3> beyond;  ///< the points beyond the image that close it
    FloatGridPtr level_set;    ///< on a domain wider than the image
    BandReport band;
    TagDistanceChoice tag;
    const char* how = "";
};

/// @param beyond  points outside the image that close the cloud there
/// @return none if the points enclose nothing even with `beyond`
std::optional<CutBody> tag_with(const Tagger& tagger, const std::vector<Vec3>& points, const Domain& domain,
                                std::vector<Vec3> beyond, const char* how) {
    std::vector<Vec3> closed = points;
    append(beyond, closed);
    CutBody body{.beyond = std::move(beyond), .level_set = nullptr, .band = {}, .tag = {}, .how = how};
    if (const std::optional<double>& given = tagger.problem.options.tag_distance) {
        body.tag.tag_distance = *given;
    } else {
        body.tag = tagger.choose(
            closed, around(domain, closed, 0.25 * longest_side(bounding_box(closed)) + kBeyondVoxels * tagger.h));
        if (!body.tag.encloses) return {};
    }
    const double D = body.tag.tag_distance;
    const BandResult tagged = tagger.tag(closed, around(domain, closed, D + kBeyondVoxels * tagger.h), D);
    if (tagged.report.leaks) return {};
    body.band = tagged.report;
    body.level_set = close_by_ball(*tagged.grid, D, tagger.problem.run);
    if (!body.level_set) body.level_set = tagged.grid;
    return body;
}

/// Whether the points alone enclose a body, so that none need to be added beyond the image's end to close it.
bool encloses_alone(const Tagger& tagger, const std::vector<Vec3>& points, const Domain& domain) {
    if (const std::optional<double>& D = tagger.problem.options.tag_distance)
        return !tagger.tag(points, domain, *D).report.leaks;
    return tagger.choose(points, domain).encloses;
}

std::optional<CutBody> find_cut_body(const Tagger& tagger, const std::vector<Vec3>& points, const Domain& domain,
                                     const std::vector<detail::ImageFace>& faces) {
    const auto is_at_end = [&](const Vec3& p) {
        return std::any_of(faces.begin(), faces.end(), [&](const auto& f) { return detail::on_end_slice(f, p); });
    };
    if (std::any_of(points.begin(), points.end(), is_at_end)) {
        std::optional<CutBody> body =
            tag_with(tagger, points, domain, detail::carried_on(points, faces, kBeyondVoxels * tagger.h),
                     "the marks' section on the image's end slices is continued beyond it");
        if (body) return body;
    }
    // Only points near a face of the image are mirrored. A wide gap between a face and the points may be a hole in the
    // points, and does not show that the face cuts the body.
    std::vector<Vec3> images = detail::mirrored(points, faces, kHoles.far * measure_spacing(points).median);
    if (images.empty() || encloses_alone(tagger, points, domain)) return {};
    return tag_with(tagger, points, domain, std::move(images),
                    "together with their mirror image beyond the image's end, the marks enclose a body");
}

/// The marks, of which those that attract also include the points that continue them beyond the image. Marks at an end
/// slice that lie deep inside the body are left out: these only show that the body extends beyond the image, and do not
/// lie on the surface.
/// @param beyond  the points that continue the marks beyond the image
MarkSets with_cut(MarkSets marks, const std::vector<Vec3>& beyond, const StartSurface& start,
                  const std::vector<detail::ImageFace>& faces, Remarks& remarks, const RunContext& run) {
    const double deep = kInference.off_cells * start.h();
    const auto level = start.u->getConstAccessor();
    const auto caps = [&](const Vec3& p) {
        const Vec3 at = start.facts.domain.world_to_index(p);
        return std::any_of(faces.begin(), faces.end(),
                           [&](const auto& face) { return face.depth(p) <= face.spacing; }) &&
               level.getValue(openvdb::Coord::round(openvdb::Vec3d(at[0], at[1], at[2]))) < -deep;
    };
    const auto dropped = std::count_if(marks.attracting.begin(), marks.attracting.end(), caps);
    append(beyond, marks.attracting);
    for (std::vector<Vec3>* const set : {&marks.attracting, &marks.trusted}) std::erase_if(*set, caps);
    if (dropped > 0)
        remarks.choose(
            "cap_marks", std::to_string(dropped),
            "marks within the section on the image's end slices close the body there and do not attract the surface",
            run);
    return marks;
}

// Starts from a body that the image cuts off, if there is one. Ordinary tagging would fail there: the flood would enter
// the body through the cut, or would not reach between a face of the image and a surface at a small angle to it.
std::optional<StartSurface> start_from_cut_body(const Tagger& tagger, const Choices& choices, const MarkSets& marks) {
    const Problem& problem = tagger.problem;
    if (problem.image == nullptr || problem.options.roi) return {};
    const std::vector<detail::ImageFace> faces = detail::faces_of(problem.image->geometry());
    StartSurface start;
    StartFacts& facts = start.facts;
    std::optional<CutBody> body;
    {
        const Timed timed(facts.report.seconds.tag);
        const Domain domain = problem.domain(tagger.h, marks.attracting, 0);
        body = find_cut_body(tagger, marks.attracting, domain, faces);
        if (!body) return {};
        // If the body ended at the image's end, the flow would bend its surface until it is perpendicular to that end.
        facts.domain = widened(domain, int(kBeyondVoxels));
        start.u = start_from_grid(facts.domain, *body->level_set, problem.run);
    }
    Remarks& remarks = facts.report.remarks;
    const double D = body->tag.tag_distance;
    remarks.choose("start", "cut body", body->how, problem.run);
    if (!problem.options.tag_distance) remarks.choose("tag_distance", number(D), body->tag.reason, problem.run);
    facts.origin = StartOrigin::Tagged;
    facts.tag_distance = D;
    facts.tag = body->tag;
    facts.band = body->band;
    facts.flow = choices.evolve;
    facts.flow.follow = true;
    facts.marks = with_cut(marks, body->beyond, start, faces, remarks, problem.run);
    if (uses_points(facts.flow))
        start.distance =
            find_distance(facts.marks.attracting, facts.domain, D + band_slack(tagger.h), D, facts.report, problem.run);
    return start;
}

/// Rejects points in one plane, on a line or at fewer than four positions, which define no surface, and parts that are
/// too far apart for it: tagging and a flow would take half a minute to find that out.
void refuse_flat(const Problem& problem, const Choices& choices, const std::vector<Vec3>& points) {
    const SegmentOptions& o = problem.options;
    if (problem.image != nullptr || o.contours || o.tag_distance || problem.has_seeds() ||
        choices.evolve.max_steps == 0 || can_enclose(points))
        return;
    throw Error(Errc::InvalidInput, "segment: " + detail::why_nothing_held(points, 0, false), "tag_distance");
}

}  // namespace

StartSurface start_by_tagging(const Problem& problem, const Choices& choices, MarkSets marks,
                              const std::vector<Vec3>& hole_seeds) {
    const RunContext& run = problem.run;
    const double h = choices.h;
    refuse_flat(problem, choices, marks.attracting);
    Tagger tagger{problem, h, problem.options.exterior_seeds, hole_seeds};
    append(problem.options.outside, tagger.outside);
    if (std::optional<StartSurface> cut = start_from_cut_body(tagger, choices, marks)) return std::move(*cut);
    StartSurface start;
    StartFacts& facts = start.facts;
    Remarks& remarks = facts.report.remarks;
    facts.origin = StartOrigin::Tagged;
    facts.marks = std::move(marks);
    facts.flow = choices.evolve;
    const std::vector<Vec3>& points = facts.marks.attracting;
    facts.tag_distance = problem.options.tag_distance;
    if (!facts.tag_distance) {
        const Timed timed(facts.report.seconds.tag);
        // A domain that is wide enough for any D below a quarter of the cloud's size. The final one is made once D is
        // known.
        const double margin = 0.25 * longest_side(bounding_box(points)) + kBeyondVoxels * h;
        facts.tag = tagger.choose(points, problem.domain_with_margin(h, points, margin));
        facts.tag_distance = facts.tag.tag_distance;
        remarks.choose("tag_distance", number(facts.tag.tag_distance), facts.tag.reason, run);
    }
    const double D = facts.tag.tag_distance = *facts.tag_distance;
    facts.domain = problem.domain(h, points, D + kBeyondVoxels * h);
    start.distance = find_distance(points, facts.domain, D + band_slack(h), D, facts.report, run);
    const Timed timed(facts.report.seconds.tag);
    const BandResult tagged =
        tag_interior(*start.distance, {D, tagger.seeds_beyond(D, *start.distance, facts.domain)}, run);
    facts.band = tagged.report;
    facts.encloses = problem.options.tag_distance ? !tagged.report.leaks : facts.tag.encloses;
    start.u = tagged.grid;
    if (tagged.report.leaks) remarks.warn(tagged.report.leak(), run);
    if (D <= band_slack(h)) return start;
    // The tagged surface lies D outside the points, which is far if a gap is wide. Its closing by a ball of radius D
    // touches the points, needs a band of a few voxels instead of {d <= D + 3h}, and is closer to the result.
    if (const FloatGridPtr closed = close_by_ball(*start.u, D, run)) {
        start.u = closed;
        facts.flow.follow = true;
        remarks.choose(
            "start", "closing",
            "of the tagged surface by a ball of radius D, because D exceeds " + number(band_slack(1)) + " voxels", run);
    }
    return start;
}

}  // namespace covol::pipeline
