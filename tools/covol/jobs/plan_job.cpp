#include "jobs/plan_job.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <optional>
#include <set>
#include <sstream>

#include "cli/output/bytes_text.h"
#include "cli/output/report.h"
#include "covol/error.h"
#include "jobs/structure_inputs.h"
#include "jobs/timelapse_job.h"

namespace covol::tool {
namespace {

// Measured, see docs/benchmarks_speed.md, Plans. Memory in bytes.
constexpr double kBandBytes = 108;       ///< peak memory for each voxel of the band, including mesh and files
constexpr double kTubeBytes = 12;        ///< memory for each voxel of the tube in which the distance is stored
constexpr double kBaseBytes = 6.5e7;     ///< memory of the program itself
constexpr double kGuessBandBytes = 335;  ///< instead of kBandBytes if a guess is fitted to the image
constexpr double kCloudPointBytes = 4000, kMaxCloudBytes = 1e8;  ///< for each point of a cloud; maximum for a cloud
constexpr double kFlowTime = 1.3;                                ///< time of a flow with an image / without an image
constexpr double kGuessTime = 2.8;    ///< the same ratio for a guess; includes estimating the appearance
constexpr double kPilotVoxels = 128;  ///< maximum along the longest side of the marks' box, on the finer coarse lattice
constexpr double kReachVoxels = 12;   ///< voxels; a flow samples the image within this distance of the surface
constexpr double kGuessVoxels = 25;   ///< voxels; a guess smooths the image within this distance of the surface's box
constexpr double kGuessBytes = 8;     ///< memory for each smoothed voxel of the image, for two copies
constexpr std::int64_t kMappedBytes = 1 << 16;  ///< pages of a mapped file that the system loads at once

/// Result of a run on a coarse lattice with the marks alone, without the image.
struct Pilot {
    double voxel_size = 0, active_voxels = 0, tube_voxels = 0, seconds = 0;
    bool is_guess = false, is_cloud = false;
    FloatGridPtr surface;
};

struct StructurePlan {
    std::string name;
    double active_voxels = 0, tube_voxels = 0, seconds = 0;
    double bytes_while_solved = 0;   ///< in addition to kBandBytes for each voxel of the band
    double smoothed_voxels = 0;      ///< voxels of the image that are smoothed
    std::set<std::uint64_t> blocks;  ///< numbers of the blocks of the image that are read
};

Pilot run_pilot(const SegmentJob& job, const Marks& marks, const std::optional<ImageGeometry>& geometry, double h,
                const RunContext& quiet) {
    const StructureInput input = prepare_marks({marks}, geometry, job.resolve(h), job.marks_options(h), quiet).front();
    SegmentOptions options = input.options;
    options.evolve.rho = 0;
    options.without_mesh = true;
    options.holes = {};
    options.extract = {};
    options.without_fields = false;
    Stopwatch watch;
    SegmentResult result = reconstruct(input.points, options, quiet);
    Start start = result.report.resolved.start;
    if (geometry && is_any<CloudStart>(start)) {  // CloudStart is only for jobs without an image
        options.start = start = TagStart{};
        watch = {};
        result = reconstruct(input.points, options, quiet);
    }
    Pilot pilot{result.report.resolved.voxel_size.value_or(h),
                double(result.report.active_voxels),
                0,
                watch.seconds(),
                is_any<GuessStart>(start),
                is_any<CloudStart>(start),
                result.surface};
    if (result.distance) pilot.tube_voxels = double(result.distance->activeVoxelCount());
    return pilot;
}

/// The size in voxels of the part of an image that is read at once: a chunk, or consecutive pages of a mapped file. 0:
/// the whole image.
Index3 block_of(const ImageInfo& image) {
    if (image.bytes_to_hold > 0 || image.chunk_size[0] > 0) return image.chunk_size;
    const auto voxels = std::int32_t(kMappedBytes / std::int64_t(bytes_of(image.type)));
    const Index3& n = image.geometry.size;
    return {std::min(n[0], voxels), std::clamp(voxels / n[0], 1, n[1]), 1};
}

double voxels_of(const Index3& size) { return double(size[0]) * size[1] * size[2]; }

/// The blocks of an image that contain given positions.
class Blocks {
public:
    explicit Blocks(const ImageInfo& image) : geometry_(image.geometry), block_(block_of(image)) {
        for (int a = 0; a < 3; ++a) counts_[a] = (geometry_.size[a] - 1) / block_[a] + 1;
    }
    [[nodiscard]] double count() const { return voxels_of(counts_); }

    /// Adds the blocks that contain voxels with indices from `low` to `high`.
    void add(const Vec3& low, const Vec3& high) {
        Index3 first, last;
        for (int a = 0; a < 3; ++a) {
            const double end = geometry_.size[a] - 1;
            first[a] = int(std::clamp(low[a], 0.0, end)) / block_[a];
            last[a] = int(std::clamp(high[a], 0.0, end)) / block_[a];
        }
        for (int k = first[2]; k <= last[2]; ++k)
            for (int j = first[1]; j <= last[1]; ++j)
                for (int i = first[0]; i <= last[0]; ++i)
                    found.insert((std::uint64_t(k) * counts_[1] + j) * counts_[0] + i);
    }

    std::set<std::uint64_t> found;

private:
    const ImageGeometry& geometry_;
    Index3 block_, counts_{};
};

/// Calls visit(low, high) for each position on the surface, with the image indices of a box of half width `reach`
/// (world units) around it.
template <typename Visit>
void for_each_place(const FloatGrid& surface, const ImageGeometry& g, double reach, const Visit& visit) {
    const double h = surface.voxelSize()[0];
    for (auto value = surface.cbeginValueOn(); value; ++value) {
        if (std::abs(*value) > h) continue;
        const openvdb::Vec3d w = surface.indexToWorld(value.getCoord());
        const Vec3 at = g.world_to_index({w[0], w[1], w[2]});
        Vec3 low, high;
        for (int a = 0; a < 3; ++a) {
            low[a] = at[a] - reach / g.spacing[a];
            high[a] = at[a] + reach / g.spacing[a];
        }
        visit(low, high);
    }
}

/// Adds the blocks of the image that a flow reads: those within `reach` (world units) of the surface.
void plan_samples(const FloatGrid& surface, const ImageInfo& image, double reach, StructurePlan& plan) {
    if (block_of(image)[0] == 0) return;
    Blocks blocks(image);
    for_each_place(surface, image.geometry, reach + surface.voxelSize()[0],
                   [&](const Vec3& low, const Vec3& high) { blocks.add(low, high); });
    plan.blocks = std::move(blocks.found);
}

/// Adds the part of the image that a guess reads and smooths: within `reach` (world units) of the surface's box.
void plan_smoothing(const FloatGrid& surface, const ImageInfo& image, double reach, StructurePlan& plan) {
    Vec3 lowest, highest;
    lowest.fill(1e300);
    highest.fill(-1e300);
    for_each_place(surface, image.geometry, reach, [&](const Vec3& low, const Vec3& high) {
        for (int a = 0; a < 3; ++a) {
            lowest[a] = std::min(lowest[a], low[a]);
            highest[a] = std::max(highest[a], high[a]);
        }
    });
    plan.smoothed_voxels = 1;
    for (int a = 0; a < 3; ++a) {
        const double end = image.geometry.size[a] - 1;
        plan.smoothed_voxels *= std::clamp(highest[a], 0.0, end) - std::clamp(lowest[a], 0.0, end) + 1;
    }
    if (block_of(image)[0] == 0) return;
    Blocks blocks(image);
    blocks.add(lowest, highest);
    plan.blocks = std::move(blocks.found);
}

StructurePlan plan_structure(const SegmentJob& job, Marks marks, const ImageInfo* image, double given_h,
                             Session& session, const RunContext& quiet) {
    std::optional<ImageGeometry> geometry;
    if (image != nullptr) geometry = image->geometry;
    read_marks(marks, geometry, job.reading(quiet), quiet);
    if (!geometry) thin_points(marks, job.cloud.inputs.options.max_points, quiet);
    const std::vector<Vec3> given = positions_of(marks, geometry);
    if (given.empty())
        throw Error(Errc::InvalidInput,
                    "plan: expected points or contours, got none: how far the surface moves cannot be predicted "
                    "without marks");
    const double h = given_h > 0 ? given_h : job.resolve_voxel_size(nullptr, marks, geometry, session);
    const double coarse = std::max(h, longest_side(bounding_box(given)) / kPilotVoxels);
    const Pilot coarser = run_pilot(job, marks, geometry, 2 * coarse, quiet);
    const Pilot pilot = run_pilot(job, marks, geometry, coarse, quiet);
    // Model of the time: seconds = fixed + growing / h^2. The two pilot runs determine `fixed` and `growing`.
    const double c = pilot.voxel_size, d = std::max(coarser.voxel_size, 1.01 * c);
    const double growing = std::max(0.0, (pilot.seconds - coarser.seconds) / (1 / (c * c) - 1 / (d * d)));
    const double fixed = std::max(0.0, pilot.seconds - growing / (c * c));
    StructurePlan plan;
    plan.name = marks.name;
    const double finer = std::max(1.0, c / h);
    plan.active_voxels = pilot.active_voxels * finer * finer;
    plan.tube_voxels = pilot.tube_voxels * finer * finer * finer;
    plan.seconds = fixed + growing / (c * c) * finer * finer;
    if (image != nullptr) plan.seconds *= pilot.is_guess ? kGuessTime : kFlowTime;
    plan.bytes_while_solved = kTubeBytes * plan.tube_voxels - kBandBytes * plan.active_voxels;
    if (pilot.is_cloud) plan.bytes_while_solved = std::min(kCloudPointBytes * double(given.size()), kMaxCloudBytes);
    if (image == nullptr) return plan;
    if (pilot.is_guess) {
        plan_smoothing(*pilot.surface, *image, kGuessVoxels * h, plan);
        plan.bytes_while_solved =
            (kGuessBandBytes - kBandBytes) * plan.active_voxels + kGuessBytes * plan.smoothed_voxels;
    } else {
        plan_samples(*pilot.surface, *image, kReachVoxels * h, plan);
    }
    return plan;
}

std::string size_text(const Index3& n) {
    return std::to_string(n[0]) + " x " + std::to_string(n[1]) + " x " + std::to_string(n[2]);
}

}  // namespace

void run_plan(const SegmentJob& job, Session& session) {
    if (is_timelapse(job))
        throw UsageError("plan: expected one image and one frame: every frame needs as much as a single one");
    job.check_options();
    RunContext quiet = session.run();
    quiet.log = {};
    Json plan;
    std::optional<ImageInfo> image;
    double given_h = 0, image_bytes = 0, pixel_bytes = 0;
    if (!job.images.empty()) {
        ReadImageOptions reading = job.image.options;
        reading.roi = job.given.options.roi;
        image = read_image_info(job.images.front(), reading, session.run());
        const double finest = image->geometry.smallest_spacing();
        given_h = job.given.length("voxel_size").resolve(finest, finest);
        const Index3& n = image->geometry.size;
        pixel_bytes = double(bytes_of(image->type));
        image_bytes = double(n[0]) * n[1] * n[2] * pixel_bytes;
        plan["image"] = {{"path", job.images.front()},
                         {"format", image->format},
                         {"size", n},
                         {"type", to_string(image->type)},
                         {"unpacked_bytes", std::llround(image_bytes)}};
        session.print("image: " + size_text(n) + " " + to_string(image->type) + ", " + image->format + ", " +
                      bytes_text(image_bytes) + " unpacked");
    }
    double voxels = 0, while_solved = 0, seconds = 0;
    std::set<std::uint64_t> blocks;
    std::vector<Marks> structures = structures_of(job, job.painted.read(session.run()));
    add_starts(job, structures, session.run());
    read_shared_files(job, structures, image ? std::optional(image->geometry) : std::nullopt, quiet);
    for (const Marks& marks : structures) {
        const StructurePlan one = plan_structure(job, marks, image ? &*image : nullptr, given_h, session, quiet);
        voxels += one.active_voxels;
        while_solved = std::max(while_solved, one.bytes_while_solved);
        seconds += one.seconds;
        blocks.insert(one.blocks.begin(), one.blocks.end());
    }
    double held = image ? double(image->bytes_to_hold) : 0, mapped = 0;
    if (image && block_of(*image)[0] > 0) {
        const double each = voxels_of(block_of(*image)) * pixel_bytes, total = Blocks(*image).count();
        const bool in_chunks = image->chunk_size[0] > 0, lazily = image->bytes_to_hold == 0;
        const double read = lazily ? double(blocks.size()) : total;
        if (!in_chunks) mapped = read * each;
        if (in_chunks && lazily) held = read * each;
        if (in_chunks) {
            plan["image"]["chunks"] = {{"size", image->chunk_size},
                                       {"read", std::llround(read)},
                                       {"of", std::llround(total)},
                                       {"unpacked_bytes", std::llround(read * each)}};
            session.print("chunks of " + size_text(image->chunk_size) + ": about " +
                          std::to_string(std::llround(read)) + " of " + std::to_string(std::llround(total)) +
                          " are read, " + bytes_text(read * each) + " unpacked");
        }
    }
    const double memory = kBaseBytes + held + mapped + kBandBytes * voxels + while_solved;
    plan["mapped_bytes"] = std::llround(mapped);
    plan["active_voxels"] = std::llround(voxels);
    plan["memory_bytes"] = std::llround(memory);
    plan["seconds"] = seconds;
    session.print("band: about " + std::to_string(std::llround(voxels / 1000) * 1000) + " voxels");
    session.print("memory: about " + bytes_text(memory) +
                  (held > 0 ? ", of which the image takes " + bytes_text(held) : "") +
                  (mapped > 0 ? ", of which " + bytes_text(mapped) + " are pages of the image's file" : ""));
    std::ostringstream time;
    time << "time: about " << std::setprecision(2) << seconds << " s on this machine, without decompressing an image";
    session.print(time.str());
    session.report()["plan"] = plan;
}

}  // namespace covol::tool
