#include "segment/doubts.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "covol/error.h"
#include "image/support.h"
#include "points/kd_tree.h"
#include "segment/heuristics.h"

namespace covol::pipeline {
namespace {

double off(const Job& job) {
    double edge = job.h();
    if (job.image != nullptr)
        for (const double s : job.image->geometry().spacing) edge = std::max(edge, s);
    return std::max(kDoubts.off_voxels * edge, kDoubts.off_noise * job.result.report.cloud.noise);
}

std::string place(const Job& job, const Vec3& mark) {
    if (job.image == nullptr) return "at " + detail::to_text(mark);
    const Vec3 index = job.image->geometry().world_to_index(mark);
    return "on slice " + std::to_string(std::lround(index[2])) + ", at voxel " + detail::to_text(index);
}

void find_marks_off(Job& job, const std::vector<Vec3>& marks, const std::vector<double>& distances) {
    SegmentReport::MarksOff& found = job.report().marks_off;
    found.beyond = off(job);
    for (std::size_t n = 0; n < marks.size(); ++n) {
        found.count += distances[n] > found.beyond;
        if (distances[n] <= found.farthest) continue;
        found.farthest = distances[n];
        found.farthest_world = found.farthest_index = marks[n];
    }
    if (job.image != nullptr) found.farthest_index = job.image->geometry().world_to_index(found.farthest_world);
    if (found.count == 0) return;
    job.warn(std::to_string(found.count) + " of " + std::to_string(marks.size()) + " marks lie more than " +
             number(found.beyond) + " off the surface, the farthest " + number(found.farthest) + " " +
             place(job, found.farthest_world) + ": look there whether the mark is wrong, or mark more beside it");
}

void find_bias(Job& job, const std::vector<Vec3>& marks, const std::vector<double>& distances) {
    const std::vector<double> levels = levels_at(*job.result.surface, marks);
    double sum = 0, squares = 0;
    for (std::size_t n = 0; n < marks.size(); ++n) {
        const double d = std::copysign(distances[n], levels[n]);
        sum += d;
        squares += d * d;
    }
    const auto count = double(marks.size());
    const double bias = sum / count, error = std::sqrt(std::max(0.0, squares / count - bias * bias) / count);
    job.report().fit.bias = bias;
    if (std::abs(bias) < kDoubts.bias_voxels * std::max(job.h(), job.report().cloud.noise) ||
        std::abs(bias) < kDoubts.bias_errors * error)
        return;
    job.warn("the marks lie " + number(std::abs(bias) / job.h()) + " voxels " + (bias > 0 ? "outside" : "inside") +
             " the surface on the mean: it is too " + (bias > 0 ? "small" : "large"));
}

/// One place of the surface for each leaf that it passes.
std::vector<Vec3> places_on(const FloatGrid& surface) {
    std::vector<Vec3> places;
    for (auto leaf = surface.tree().cbeginLeaf(); leaf; ++leaf) {
        float least = float(surface.voxelSize()[0]);
        openvdb::Coord at;
        bool found = false;
        for (auto value = leaf->cbeginValueOn(); value; ++value)
            if (std::abs(*value) < least) {
                least = std::abs(*value);
                at = value.getCoord();
                found = true;
            }
        if (!found) continue;
        const openvdb::Vec3d world = surface.indexToWorld(at);
        places.push_back({world[0], world[1], world[2]});
    }
    return places;
}

/// A surface through marks may bend least where it goes on for ever.
void find_surface_beyond(Job& job, const std::vector<Vec3>& marks) {
    const WorldBox box = bounding_box(marks);
    const double diagonal = std::hypot(box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2]);
    const double far = kDoubts.far_diagonals * diagonal;
    const std::vector<Vec3> places = places_on(*job.result.surface);
    const detail::KdTree tree(marks);
    const auto beyond =
        std::count_if(places.begin(), places.end(), [&](const Vec3& place) { return tree.nearest(place) > far * far; });
    const double share = double(beyond) / double(std::max<std::size_t>(1, places.size()));
    job.report().surface_beyond_marks = share;
    if (share > kDoubts.far_share)
        job.warn(number(std::round(100 * share)) + " % of the surface lie farther than " + number(far) +
                 ", half of what the marks measure across, from every mark: it goes on where nothing is marked; mark "
                 "more there, or give a place outside the body (`outside`)");
}

/// Some of the marks, and the surface's normals there.
struct Normals {
    std::vector<Vec3> places, normals;
};

Normals normals_at(const Job& job, const std::vector<Vec3>& marks) {
    const std::size_t every = std::max<std::size_t>(1, marks.size() / kDoubts.support_marks);
    std::vector<Vec3> beside;  // of each, before and behind along each axis
    for (std::size_t n = 0; n < marks.size(); n += every)
        for (int a = 0; a < 3; ++a)
            for (const double step : {-0.5, 0.5}) beside.emplace_back(marks[n])[std::size_t(a)] += step * job.h();
    const std::vector<double> levels = levels_at(*job.result.surface, beside);
    Normals found;
    for (std::size_t n = 0, first = 0; n < marks.size(); n += every, first += 6) {
        Vec3 normal{};
        for (std::size_t a = 0; a < 3; ++a) normal[a] = levels[first + 2 * a + 1] - levels[first + 2 * a];
        const double length = std::hypot(normal[0], normal[1], normal[2]);
        if (!(length > 0.5 * job.h())) continue;  // off the band
        for (double& c : normal) c /= length;
        found.places.push_back(marks[n]);
        found.normals.push_back(normal);
    }
    return found;
}

/// Values are computed on in single precision.
void find_lost_precision(Job& job) {
    const auto [low, high] = job.image->percentiles(0.01, 0.99);
    const double largest = std::max(std::abs(low), std::abs(high));
    const double step = largest * std::numeric_limits<float>::epsilon();
    if (high > low && step > kDoubts.lost_precision * (high - low))
        job.warn("the image's values lie between " + number(low) + " and " + number(high) +
                 ", where single precision has steps of " + number(step) + ": subtract an offset first");
}

/// Marks of another image, of another channel or space, look like marks: the image knows better.
void find_strange_image(Job& job, const std::vector<Vec3>& marks) {
    const Normals at = normals_at(job, marks);
    const detail::ImageSupport support = detail::measure_support(*job.image, at.places, at.normals, job.h(), job.run);
    if (support.places == 0) return;
    job.report().image_support = support.share;
    const GuidanceReport& guidance = job.report().guidance;
    const EdgeFeature feature = guidance.used ? guidance.feature.feature : job.options.edge.feature;
    const detail::StrongestBorder border = detail::find_strongest_border(
        *job.image, at.places, at.normals, job.h(),
        feature > EdgeFeature::Slope ? detail::BorderKind::Line : detail::BorderKind::Slope, job.run);
    job.report().image_border = {border.at, border.share, border.errors};
    const char* const look = ": look whether the marks belong to this image, channel and space";
    if (support.share + kDoubts.support_errors * support.error < kDoubts.image_support)
        job.warn("the image varies more five voxels beside the marks than where they lie (in " +
                 number(std::round(100 * (1 - support.share))) + " of 100 pairs)" + look);
    else if (guidance.used && guidance.gain < kDoubts.least_gain && support.share < kDoubts.clear_support)
        job.warn("what the image shows at some marks hardly foretells where the others lie (gain " +
                 number(guidance.gain) + " nats a mark)" + look);
    else if (border.share < kDoubts.border_share && border.errors > kDoubts.border_errors)
        job.warn("the image has steeper borders " + std::to_string(std::abs(border.at)) + " voxels " +
                 (border.at < 0 ? "inside" : "outside") + " the marks, all along (where they lie it has " +
                 number(std::round(100 * border.share)) + " % of that)" + look + ", and are of its size");
}

void find_silent_image(Job& job) {
    const GuidanceReport& guidance = job.report().guidance;
    if (job.rests() && !guidance.used && !guidance.reason.empty())
        job.warn("the image had no say between the marks: " + guidance.reason);
}

/// Noise fills space as far as it reaches; what is smoothed like it, though the nearest points lie on sheets, are
/// folds.
void find_folds(Job& job) {
    const CloudReport& cloud = job.report().cloud;
    if (cloud.noise > cloud.nearest && cloud.noise > kDoubts.folded_noise * cloud.near_noise &&
        cloud.near_noise < kDoubts.sheet * cloud.near_reach)
        job.warn("the surface is smoothed as if the points had noise of " + number(cloud.noise) +
                 ", but the nearest of them lie on sheets (" + number(cloud.near_noise) + " off them within " +
                 number(cloud.near_reach) +
                 "): folds or walls closer together than two or three points are lost; sample more densely there");
}

/// Places all over the outermost voxels of the image, world units.
std::vector<Vec3> places_on_border(const ImageGeometry& geometry) {
    constexpr int kPlaces = 24;  // along an edge
    std::vector<Vec3> places;
    for (int axis = 0; axis < 3; ++axis)
        for (const bool upper : {false, true})
            for (int i = 0; i < kPlaces; ++i)
                for (int j = 0; j < kPlaces; ++j) {
                    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
                    Vec3 index;
                    index[axis] = upper ? geometry.size[axis] - 1 : 0;
                    index[u] = (i + 0.5) / kPlaces * geometry.size[u] - 0.5;
                    index[v] = (j + 0.5) / kPlaces * geometry.size[v] - 0.5;
                    places.push_back(geometry.index_to_world(index));
                }
    return places;
}

std::vector<char> are_inside(const FloatGrid& u, const std::vector<Vec3>& places) {
    std::vector<char> inside;
    const auto accessor = u.getConstAccessor();
    for (const Vec3& p : places)
        inside.push_back(accessor.getValue(openvdb::Coord::round(u.worldToIndex(openvdb::Vec3d(p[0], p[1], p[2])))) <
                         0);
    return inside;
}

}  // namespace

void note_border(Job& job) {
    if (job.image != nullptr) job.border_in_start = are_inside(*job.result.u, places_on_border(job.image->geometry()));
}

void require_outside(const Job& job) {
    if (job.image == nullptr || job.options.roi) return;
    const std::vector<Vec3> places = places_on_border(job.image->geometry());
    const std::vector<char> inside = are_inside(*job.result.u, places);
    if (2 * std::count(inside.begin(), inside.end(), 1) <= std::ptrdiff_t(places.size())) return;
    std::vector<Vec3> known = job.given;
    known.insert(known.end(), job.options.inside.begin(), job.options.inside.end());
    const WorldBox box = bounding_box(known.empty() ? places : known);
    const double far =
        kDoubts.far_diagonals * std::hypot(box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2]);
    const detail::KdTree tree(known);
    std::size_t unexpected = 0;
    for (std::size_t n = 0; n < places.size(); ++n) {
        if (!inside[n] || (!job.border_in_start.empty() && job.border_in_start[n])) continue;
        unexpected += tree.nearest(places[n]) > far * far;
    }
    if (2 * unexpected <= places.size()) return;
    throw Error(Errc::InvalidInput,
                "segment: the surface is inside out: " +
                    number(std::round(100.0 * double(unexpected) / double(places.size()))) +
                    " % of the image's border would be inside, where neither marks nor seeds say so; mark more of the "
                    "body, or give places outside of it (`outside`)");
}

std::vector<double> levels_at(const FloatGrid& u, const std::vector<Vec3>& places) {
    std::vector<double> levels(places.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, places.size(), 256), [&](const auto& range) {
        const auto accessor = u.getConstAccessor();
        for (std::size_t n = range.begin(); n != range.end(); ++n)
            levels[n] = openvdb::tools::BoxSampler::sample(
                accessor, u.worldToIndex(openvdb::Vec3d(places[n][0], places[n][1], places[n][2])));
    });
    return levels;
}

void doubt_isolated_marks(Job& job) {
    const std::vector<IsolatedPoint> isolated = find_isolated_points(job.given);
    if (isolated.empty()) return;
    constexpr std::size_t kTold = 3;
    std::string places;
    for (std::size_t n = 0; n < std::min(isolated.size(), kTold); ++n)
        places += (n == 0 ? "" : "; ") + place(job, job.given[isolated[n].index]) + ", " +
                  number(isolated[n].distance) + " away";
    if (isolated.size() > kTold) places += "; ...";
    job.warn(std::to_string(isolated.size()) + " of " + std::to_string(job.given.size()) +
             " marks lie apart from all others (" + places +
             "): the surface goes there, too; look whether they are mistakes" +
             (job.options.contours ? "" : ", which `outlier_factor` leaves out") + ", or mark more beside them");
}

void doubt(Job& job, const std::vector<Vec3>& marks, const std::vector<double>& distances) {
    find_marks_off(job, marks, distances);
    find_bias(job, marks, distances);
    if (job.origin == StartOrigin::Guess) find_surface_beyond(job, marks);
    if (job.origin == StartOrigin::Cloud) find_folds(job);
    if (job.image == nullptr || !job.uses_image()) return;
    find_lost_precision(job);
    find_strange_image(job, marks);
    find_silent_image(job);
}

bool misses_marks(const Job& job, const FloatGrid& u) {
    const double beyond = std::min(off(job), 0.9 * double(u.background()));
    const std::vector<double> levels = levels_at(u, job.trusted);
    const auto far =
        std::count_if(levels.begin(), levels.end(), [&](double level) { return std::abs(level) > beyond; });
    return double(far) > kDoubts.missed_share * double(job.trusted.size());
}

}  // namespace covol::pipeline
