#include "segment/doubts.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "image/support.h"
#include "segment/heuristics.h"

namespace covol::pipeline {
namespace {

double off(const Job& job) {
    double edge = job.h();
    if (job.image != nullptr)
        for (const double s : job.image->geometry().spacing) edge = std::max(edge, s);
    return std::max(kDoubts.off_voxels * edge, kDoubts.off_noise * job.result.report.cloud.noise);
}

std::string place(const Job& job, const SegmentReport::MarksOff& marks) {
    if (job.image == nullptr) return "at " + detail::to_text(marks.farthest_world);
    return "on slice " + std::to_string(std::lround(marks.farthest_index[2])) + ", at voxel " +
           detail::to_text(marks.farthest_index);
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
             place(job, found) + ": look there whether the mark is wrong, or mark more beside it");
}

void find_bias(Job& job, const std::vector<Vec3>& marks, const std::vector<double>& distances) {
    double sum = 0, squares = 0;
    for (std::size_t n = 0; n < marks.size(); ++n) {
        const double d = std::copysign(distances[n], level_at(*job.result.surface, marks[n]));
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

/// Some of the marks, and the surface's normals there.
struct Normals {
    std::vector<Vec3> places, normals;
};

Normals normals_at(const Job& job, const std::vector<Vec3>& marks) {
    const std::size_t every = std::max<std::size_t>(1, marks.size() / kDoubts.support_marks);
    Normals found;
    for (std::size_t n = 0; n < marks.size(); n += every) {
        Vec3 normal{};
        for (int a = 0; a < 3; ++a) {
            Vec3 before = marks[n], behind = marks[n];
            before[a] -= 0.5 * job.h(), behind[a] += 0.5 * job.h();
            normal[a] = level_at(*job.result.surface, behind) - level_at(*job.result.surface, before);
        }
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
    const char* const look = ": look whether the marks belong to this image, channel and space";
    if (support.share + kDoubts.support_errors * support.error < kDoubts.image_support)
        job.warn("the image varies more five voxels beside the marks than where they lie (in " +
                 number(std::round(100 * (1 - support.share))) + " of 100 pairs)" + look);
    else if (guidance.used && guidance.gain < kDoubts.least_gain)
        job.warn("what the image shows at some marks hardly foretells where the others lie (gain " +
                 number(guidance.gain) + " nats a mark)" + look);
}

void find_silent_image(Job& job) {
    const GuidanceReport& guidance = job.report().guidance;
    if (job.rests() && !guidance.used && !guidance.reason.empty())
        job.warn("the image had no say between the marks: " + guidance.reason);
}

}  // namespace

double level_at(const FloatGrid& u, const Vec3& world) {
    return openvdb::tools::BoxSampler::sample(u.getConstAccessor(),
                                              u.worldToIndex(openvdb::Vec3d(world[0], world[1], world[2])));
}

void doubt(Job& job, const std::vector<Vec3>& marks, const std::vector<double>& distances) {
    find_marks_off(job, marks, distances);
    find_bias(job, marks, distances);
    if (job.image == nullptr || !job.uses_image()) return;
    find_lost_precision(job);
    find_strange_image(job, marks);
    find_silent_image(job);
}

bool misses_marks(const Job& job, const FloatGrid& u) {
    const double beyond = std::min(off(job), 0.9 * double(u.background()));
    std::size_t far = 0;
    for (const Vec3& mark : job.trusted) far += std::abs(level_at(u, mark)) > beyond;
    return double(far) > kDoubts.missed_share * double(job.trusted.size());
}

}  // namespace covol::pipeline
