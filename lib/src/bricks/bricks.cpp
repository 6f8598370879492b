// A job in bricks: lib/include/covol/bricks.h says how.
#include "covol/bricks.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/valid.h"
#include "bricks/split.h"
#include "bricks/states.h"
#include "cloud/surface/cloud_field.h"
#include "covol/error.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "grid/flood_tiles.h"
#include "segment/automatic.h"
#include "segment/doubts.h"
#include "segment/fields.h"
#include "segment/final_surface.h"
#include "segment/flow.h"
#include "segment/heuristics.h"
#include "segment/start/starts.h"

namespace covol {
namespace {

using namespace pipeline;

constexpr double kCoarseVoxels = 400;     // most across the points, on the lattice of the coarse solve
constexpr double kLeastFactor = 2;        // voxels: least size of that lattice's voxels
constexpr int kStateLayers = 8;           // around a brick, that its state holds
constexpr int kSurfaceLayers = 8;         // around a brick: its distance to the surface rests on no more
constexpr std::size_t kEdgeSamples = 64;  // coarse leaves at which the image is looked at to fix what g means

/// What is solved with, or without, an image.
SegmentResult solve_whole(const Job& job, const SegmentOptions& options) {
    return job.image != nullptr ? segment(*job.image, job.given, options, job.run)
                                : reconstruct(job.given, options, job.run);
}

void require_bricks_can(const Job& job) {
    const auto refuse = [](const std::string& what) {
        throw Error(Errc::Unsupported, "bricks: " + what +
                                           ": such a surface rests on all of them at once; solve it in one piece, "
                                           "with a larger `voxel_size` where memory does not do");
    };
    if (job.options.contours) refuse("contours, got some");
    if (job.options.guess) refuse("expected no guess to correct, got one");
    if (job.guesses())
        refuse(std::to_string(job.points.size()) + " marks are a guess; `model = Paper`, or more marks, flow");
}

/// The voxels of one lattice that a coarse solve's domain covers.
Domain fine_domain(const Job& job, const Domain& coarse) {
    const Domain own = job.domain_with_chosen_margin(0);
    if (job.image == nullptr && !job.options.roi) return covering(own, coarse.world_box());
    // A body that the image cuts is solved beyond its end, too.
    const double beyond = own.world_box().min[0] - coarse.world_box().min[0];
    return beyond > 2 * coarse.voxel_size ? widened(own, kStarts.tagged_beyond_voxels) : own;
}

/// The fine band at some leaves of the coarse one, spread over all of it.
FloatGridPtr sample_band(const FloatGrid& coarse, const Domain& domain, const RunContext& run) {
    std::vector<const FloatGrid::TreeType::LeafNodeType*> leaves;
    for (auto leaf = coarse.tree().cbeginLeaf(); leaf; ++leaf) leaves.push_back(leaf.getLeaf());
    const std::size_t stride = 1 + leaves.size() / kEdgeSamples;
    FloatGridPtr band = make_grid(domain, float(kHalfWidthVoxels * domain.voxel_size), "band");
    for (std::size_t n = 0; n < leaves.size(); n += stride) {
        const openvdb::BBoxd world = coarse.transform().indexToWorld(leaves[n]->getNodeBoundingBox());
        const WorldBox box{{world.min()[0], world.min()[1], world.min()[2]},
                           {world.max()[0], world.max()[1], world.max()[2]}};
        const Domain block = covering(domain, box);
        const Domain part = bricks::around(domain, {block.min, block.max}, 0);
        if (part.min[0] > part.max[0] || part.min[1] > part.max[1] || part.min[2] > part.max[2]) continue;
        try {
            band->topologyUnion(*start_from_grid(part, coarse, run));
        } catch (const Error& error) {
            if (error.code() != Errc::InvalidInput) throw;  // no surface in that leaf
        }
    }
    return band;
}

/// K and the range of intensities, as they would be found on all of the band.
EdgeOptions fixed_edge(const Job& job, const FloatGrid& coarse, const Domain& domain) {
    if (!job.uses_image()) return job.options.edge;
    Job sample(job.image, job.points, job.options, job.run);
    sample.report().domain = domain;
    sample.options.evolve.follow = true;
    sample.result.u = sample_band(coarse, domain, job.run);
    find_edges(sample);
    return sample.options.edge;
}

/// Points that act in the part.
std::vector<Vec3> points_near(const Job& job, const Domain& part) {
    const double range = job.attraction_range();
    if (!(range > 0)) return job.points;
    const double reach = range + band_slack(job);
    std::vector<Vec3> near;
    const WorldBox box = part.world_box();
    for (const Vec3& p : job.points) {
        bool acts = true;
        for (int a = 0; a < 3; ++a) acts = acts && p[a] > box.min[a] - reach && p[a] < box.max[a] + reach;
        if (acts) near.push_back(p);
    }
    return near;
}

/// In the plan's order, in which states that overlap are summed: sums of three depend on it in their last bits.
std::vector<std::size_t> with_neighbours(const BrickPlan& plan, std::size_t brick) {
    std::vector<std::size_t> all = plan.bricks[brick].neighbours;
    all.push_back(brick);
    std::sort(all.begin(), all.end());
    return all;
}

/// Bricks whose states reach into `part`, in the plan's order.
std::vector<std::size_t> bricks_reaching(const BrickPlan& plan, const Domain& part) {
    std::vector<std::size_t> found;
    for (std::size_t n = 0; n < plan.bricks.size(); ++n) {
        const Domain kept = bricks::around(plan.domain, plan.bricks[n].core, kStateLayers);
        bool reaches = true;
        for (int a = 0; a < 3; ++a) reaches = reaches && kept.min[a] <= part.max[a] && kept.max[a] >= part.min[a];
        if (reaches) found.push_back(n);
    }
    return found;
}

/// The level set that a brick starts from; null where there is none.
FloatGridPtr start_of(const BrickPlan& plan, std::size_t brick, const BrickStates& states, const Domain& part,
                      const RunContext& run) {
    const FloatGridPtr known =
        states(brick) != nullptr ? bricks::assemble(plan, part, with_neighbours(plan, brick), states) : plan.coarse;
    try {
        return start_from_grid(part, *known, run);
    } catch (const Error& error) {
        if (error.code() != Errc::InvalidInput) throw;
        return nullptr;
    }
}

std::vector<std::size_t> all_of(const BrickPlan& plan) {
    std::vector<std::size_t> all(plan.bricks.size());
    for (std::size_t n = 0; n < all.size(); ++n) all[n] = n;
    return all;
}

}  // namespace

std::string BrickOptions::why_invalid() const {
    detail::FieldChecks checks;
    checks.expect(most_voxels > 0, "most_voxels", "> 0", double(most_voxels));
    constexpr int kFarthestVoxel = 1 << 23;  // of a lattice
    checks.expect(overlap > 0 && overlap % 8 == 0 && overlap <= kFarthestVoxel, "overlap", "a multiple of 8, 8 to 2^23",
                  overlap);
    checks.expect_positive("tolerance", tolerance);
    checks.expect(most_sweeps >= 1, "most_sweeps", ">= 1", most_sweeps);
    return checks.lines();
}

std::int64_t BrickPlan::active_voxels() const {
    std::int64_t all = 0;
    for (const Brick& brick : bricks) all += brick.active_voxels;
    return all;
}

struct BrickJob::Parts {
    RunContext run;
    SegmentOptions given;
    Job job;
    CloudReport cloud;
    std::unique_ptr<const cloud::CloudField> field;

    Parts(const Image* image, const std::vector<Vec3>& points, const SegmentOptions& options, const RunContext& context)
        : run(context), given(options), job(image, points, options, run) {
        with_threads(run, [&] {
            check_input(job);
            choose_values(job);
            require_bricks_can(job);
            if (!job.is_cloud()) return;
            choose_cloud_domain(job);
            field = std::make_unique<const cloud::CloudField>(*job.cloud, job.h(), cloud, run);
        });
    }

    /// A plan may come from elsewhere. @throws Error InvalidInput
    void require_plan_of_this_job(const BrickPlan& plan) const {
        if (plan.domain.voxel_size != job.h())
            throw Error(Errc::InvalidInput, "bricks: the plan's voxels have an edge of " +
                                                number(plan.domain.voxel_size) + ", those of its job " +
                                                number(job.h()) + ": plan again, with `voxel_size`");
    }

    /// The field on all of the lattice.
    void join(const BrickPlan& plan, const BrickStates& states) {
        job.result.u = bricks::assemble(plan, plan.domain, all_of(plan), states);
        if (field) {
            job.report().cloud = cloud;
            cloud::settle(*job.result.u, *job.cloud, job.report().cloud, run);
            job.origin = StartOrigin::Cloud;
            make_start_of_field(job);
        }
        job.report().active_voxels = std::int64_t(job.result.u->activeVoxelCount());
        job.report().leaf_count = std::int64_t(job.result.u->tree().leafCount());
    }

    /// The surface brick by brick: nothing but it is held of the whole, unless fields are wanted.
    void join_surfaces(const BrickPlan& plan, const BrickStates& states) {
        FloatGridPtr surface = make_grid(plan.domain, float(kHalfWidthVoxels * plan.domain.voxel_size), "surface");
        surface->setGridClass(openvdb::GRID_LEVEL_SET);
        const Clip clip = job.where_it_ends();
        for (std::size_t n = 0; n < plan.bricks.size(); ++n) {
            run.check();
            run.report("join", double(n) / double(plan.bricks.size()));
            const VoxelBox& core = plan.bricks[n].core;
            const Domain part = bricks::around(plan.domain, core, kSurfaceLayers);
            const FloatGridPtr u = bricks::assemble(plan, part, bricks_reaching(plan, part), states);
            if (u->tree().leafCount() == 0) continue;
            bricks::count(*u, core, job.report().active_voxels, job.report().leaf_count);
            set_clip(*u, clip);
            try {
                bricks::copy_leaves(*extract_surface(*u, run), core, *surface);
            } catch (const Error& error) {
                if (error.code() != Errc::InvalidInput) throw;  // a neighbour's band reaches it, and no surface does
            }
        }
        detail::flood_tiles(*surface, plan.domain);
        job.result.surface = surface;
        if (job.options.without_fields) return;
        job.result.u = bricks::assemble(plan, plan.domain, all_of(plan), states);
        set_clip(*job.result.u, clip);
    }

    /// The coarser lattice on which the whole is some hundred voxels wide.
    [[nodiscard]] double coarse_factor() const {
        const WorldBox box = job.points.empty() ? job.image->geometry().world_box() : bounding_box(job.points);
        double factor = kLeastFactor;
        while (longest_side(box) > kCoarseVoxels * factor * job.h()) factor *= 2;
        return factor;
    }

    void plan_cloud(BrickPlan& plan) const {
        plan.has_sweeps = false;
        plan.domain = job.domain();
        Domain lattice = plan.domain;
        lattice.voxel_size *= coarse_factor();
        CloudReport unused;
        plan.coarse = surface_from_cloud(covering(lattice, plan.domain.world_box()), *job.cloud, unused, run);
    }

    void plan_flow(BrickPlan& plan) const {
        SegmentOptions options = given;
        options.voxel_size_may_grow = false;
        options.without_mesh = true;
        options.holes = {};
        options.extract = {};
        options.without_fields = false;
        // Where the structure is too fine for so coarse a lattice, a finer one may do.
        for (double factor = coarse_factor();; factor /= 2) {
            options.voxel_size = factor * job.h();
            try {
                const SegmentResult coarse = solve_whole(job, options);
                plan.coarse = coarse.u;
                plan.domain = fine_domain(job, coarse.report.domain);
                break;
            } catch (const Error& error) {
                if (error.code() == Errc::Cancelled || factor <= kLeastFactor) throw;
                run.info("coarse solve at " + number(*options.voxel_size) + ": " + error.what());
            }
        }
        plan.edge = fixed_edge(job, *plan.coarse, plan.domain);
    }
};

BrickJob::BrickJob(const Image& image, const std::vector<Vec3>& points, const SegmentOptions& options,
                   const RunContext& run)
    : parts_(std::make_unique<Parts>(&image, points, options, run)) {}

BrickJob::BrickJob(const std::vector<Vec3>& points, const SegmentOptions& options, const RunContext& run)
    : parts_(std::make_unique<Parts>(nullptr, points, options, run)) {}

BrickJob::~BrickJob() = default;

BrickPlan BrickJob::plan(const BrickOptions& options) const {
    detail::require_valid(options, "bricks");
    BrickPlan plan;
    plan.options = options;
    with_threads(parts_->run, [&] {
        parts_->field ? parts_->plan_cloud(plan) : parts_->plan_flow(plan);
        plan.coarse->setName("coarse");
        plan.bricks = bricks::split(plan.domain, *plan.coarse, options);
    });
    return plan;
}

FloatGridPtr BrickJob::solve(const BrickPlan& plan, std::size_t brick, const BrickStates& states,
                             BrickReport& report) const {
    const RunContext& run = parts_->run;
    parts_->require_plan_of_this_job(plan);
    const VoxelBox core = plan.bricks.at(brick).core;
    const Domain kept = bricks::around(plan.domain, core, kStateLayers);
    FloatGridPtr state = make_grid(kept, float(kHalfWidthVoxels * plan.domain.voxel_size), "u");
    with_threads(run, [&] {
        const Timed timed(report.seconds);
        report.stop_reason = StopReason::Steady;
        if (parts_->field) {
            state = parts_->field->on(bricks::around(plan.domain, core, 0), run);
            report.active_voxels = std::int64_t(state->activeVoxelCount());
            return;
        }
        const Domain part = bricks::around(plan.domain, core, plan.options.overlap);
        const FloatGridPtr start = start_of(plan, brick, states, part, run);
        if (!start) return;
        Job job(parts_->job.image, points_near(parts_->job, part), parts_->job.options, run);
        job.origin = StartOrigin::CoarseLevel;
        job.report().domain = part;
        job.options.edge = plan.edge;
        job.options.evolve.follow = true;
        if (job.points.empty()) job.options.evolve.theta = 0;
        job.result.u = start;
        const bricks::Frame frame = bricks::make_frame(*start, part, plan.domain);
        job.floor = frame.floor;
        job.obstacle = frame.obstacle;
        if (job.uses_points()) find_distance(job, tube_for_start(job));
        find_edges(job);
        flow(job);
        report.stop_reason = job.report().solve.stop_reason;
        report.steps = job.report().solve.steps;
        report.active_voxels = job.report().solve.active_voxels;
        if (has_vanished(job)) return;
        job.result.u->setName("u");
        state = bricks::leaves_within(*job.result.u, {kept.min, kept.max});
        set_domain(*state, kept);
    });
    return state;
}

SegmentResult BrickJob::join(const BrickPlan& plan, const BrickStates& states, bool without_mesh) {
    const RunContext& run = parts_->run;
    Job& job = parts_->job;
    parts_->require_plan_of_this_job(plan);
    job.options.without_mesh = job.options.without_mesh || without_mesh;
    detail::require_valid(job.options, "bricks");
    with_threads(run, [&] {
        if (!job.is_cloud()) doubt_isolated_marks(job);
        job.report().domain = plan.domain;
        job.origin = StartOrigin::CoarseLevel;
        // Whatever else is made of the surface, it has the same bits.
        parts_->field ? parts_->join(plan, states) : parts_->join_surfaces(plan, states);
        if (job.report().leaf_count == 0)
            throw Error(Errc::InvalidInput,
                        "bricks: the surface vanished in all of them; lower `delta`, or start closer to the edges "
                        "(`start`)");
        SegmentReport& report = job.report();
        report.solve.stop_reason = StopReason::Steady;
        report.solve.active_voxels = report.active_voxels;
        report.solve.leaf_count = report.leaf_count;
        job.choose("bricks", std::to_string(plan.bricks.size()), "solved apart and joined");
        make_surface(job);
        report.resolved = job.options;
    });
    return std::move(job.result);
}

}  // namespace covol
