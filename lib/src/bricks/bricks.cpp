// A computation in bricks, see lib/include/covol/bricks.h.
#include "covol/bricks.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/heuristics.h"
#include "base/number.h"
#include "bricks/split.h"
#include "bricks/states.h"
#include "cloud/surface/cloud_field.h"
#include "covol/error.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "grid/flood_tiles.h"
#include "redistance/no_surface.h"
#include "segment/doubts.h"
#include "segment/result/report.h"
#include "segment/start/starts.h"

namespace covol {
namespace {

using namespace pipeline;

constexpr double kCoarseVoxels = 400;  // maximum length of the marks' or the image's box, in coarse voxels
constexpr double kMinFactor = 2;       // minimum size of a coarse voxel, in voxels of the result
constexpr int kStateLayers = 8;        // layers of voxels around a brick's core that its state includes
constexpr int kSurfaceLayers = 8;      // layers around a core from which the distance to its surface is computed
// Maximum number of leaves of the coarse band at which the image is sampled to choose the parameters of g.
constexpr std::size_t kEdgeSamples = 64;

void require_supported(const Problem& problem, const Resolved& resolved) {
    const auto reject = [](const std::string& what) {
        throw Error(Errc::Unsupported,
                    "bricks: expected marks for a flow, got " + what +
                        ", whose surface depends on all of them at once; solve it in one piece, "
                        "with a larger `voxel_size` if the memory does not suffice",
                    "voxel_size");
    };
    if (problem.options.contours) reject("contours");
    if (problem.options.guess) reject("marks that correct a guess");
    if (resolved.choices.start == StartMethod::Guess)
        reject(std::to_string(resolved.marks.attracting.size()) +
               " marks for a guess (with `model = paper`, or with more marks, there is a flow)");
}

/// The domain on the fine lattice: that of the image or of the roi; without both, it covers the domain of the coarse
/// solve.
Domain fine_domain(const Problem& problem, const Resolved& resolved, const Domain& coarse) {
    const Domain own = problem.domain(resolved.choices.h, resolved.marks.attracting, 0);
    if (problem.image == nullptr && !problem.options.roi) return covering(own, coarse.world_box());
    // If the domain of the coarse solve extends beyond the image, because the image cuts off the body, the fine domain
    // is extended as well.
    const double beyond = own.world_box().min[0] - coarse.world_box().min[0];
    return beyond > 2 * coarse.voxel_size ? widened(own, int(kBeyondVoxels)) : own;
}

/// The band on the fine lattice at up to kEdgeSamples leaves of the coarse band, spread evenly over it.
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
        } catch (const NoSurface&) {  // no surface passes through this leaf
        }
    }
    return band;
}

/// The start of the flow in a brick: its surface is close to the steady state, because it comes from the coarse solve
/// or from an earlier sweep, and the band follows it.
StartFacts facts_of_brick(const Choices& choices, const Domain& domain, std::vector<Vec3> points) {
    StartFacts facts;
    facts.origin = StartOrigin::CoarseLevel;
    facts.domain = domain;
    facts.flow = choices.evolve;
    facts.flow.follow = true;
    if (points.empty()) facts.flow.theta = 0;
    facts.marks.attracting = std::move(points);
    return facts;
}

/// The edge options with K and the range of intensities estimated on a sample of the whole band, for all bricks.
EdgeOptions fixed_edge(const Problem& problem, const Choices& choices, const FloatGrid& coarse, const Domain& domain) {
    if (!uses_image(choices.evolve)) return choices.edge;
    return find_edges(problem, facts_of_brick(choices, domain, {}), *sample_band(coarse, domain, problem.run),
                      choices.edge)
        .options;
}

/// The marks whose attraction reaches `part`; all marks if the range of attraction is not limited.
std::vector<Vec3> points_near(const Resolved& resolved, const Domain& part) {
    const std::vector<Vec3>& points = resolved.marks.attracting;
    const double range = resolved.choices.evolve.attraction_range.value_or(0);
    if (!(range > 0)) return points;
    const double reach = range + band_slack(resolved.choices.h);
    std::vector<Vec3> near;
    const WorldBox box = part.world_box();
    for (const Vec3& p : points) {
        bool acts = true;
        for (int a = 0; a < 3; ++a) acts = acts && p[a] > box.min[a] - reach && p[a] < box.max[a] + reach;
        if (acts) near.push_back(p);
    }
    return near;
}

/// The indices of a brick and its neighbours, ascending. Overlapping states are summed in this order: the last bits of
/// a sum of three numbers depend on the order.
std::vector<std::size_t> with_neighbours(const BrickPlan& plan, std::size_t brick) {
    std::vector<std::size_t> all = plan.bricks[brick].neighbours;
    all.push_back(brick);
    std::sort(all.begin(), all.end());
    return all;
}

/// The indices of the bricks whose states reach into `part`, ascending.
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

/// The level set that a brick starts from; null if no surface passes through `part`.
FloatGridPtr start_of(const BrickPlan& plan, std::size_t brick, const BrickStates& states, const Domain& part,
                      const RunContext& run) {
    const FloatGridPtr known =
        states(brick) != nullptr ? bricks::assemble(plan, part, with_neighbours(plan, brick), states) : plan.coarse;
    try {
        return start_from_grid(part, *known, run);
    } catch (const NoSurface&) {
        return nullptr;
    }
}

std::vector<std::size_t> all_of(const BrickPlan& plan) {
    std::vector<std::size_t> all(plan.bricks.size());
    for (std::size_t n = 0; n < all.size(); ++n) all[n] = n;
    return all;
}

}  // namespace

std::int64_t BrickPlan::active_voxels() const {
    std::int64_t all = 0;
    for (const Brick& brick : bricks) all += brick.active_voxels;
    return all;
}

struct BrickJob::Parts {
    RunContext run;
    std::optional<Image> image;
    std::vector<Vec3> points;
    SegmentOptions options;
    Problem problem;
    Resolved resolved;
    CloudReport cloud;
    std::unique_ptr<const cloud::CloudField> field;

    Parts(std::optional<Image> image_or_none, const std::vector<Vec3>& world_points,
          const SegmentOptions& segment_options, const RunContext& context)
        : run(context),
          image(std::move(image_or_none)),
          points(world_points),
          options(segment_options),
          problem(image ? &*image : nullptr, points, options, run) {
        with_threads(run, [&] {
            resolved = resolve(problem);
            require_supported(problem, resolved);
            const Choices& choices = resolved.choices;
            if (choices.cloud) field = std::make_unique<const cloud::CloudField>(*choices.cloud, choices.h, cloud, run);
        });
    }

    [[nodiscard]] double h() const { return resolved.choices.h; }

    /// Checks the voxel size, because a plan may have been made by another job. @throws Error InvalidInput
    void require_plan_of_this_job(const BrickPlan& plan) const {
        if (plan.domain.voxel_size != h())
            throw Error(Errc::InvalidInput, "bricks: expected a plan with the voxel size of its job, " + number(h()) +
                                                ", got " + number(plan.domain.voxel_size) +
                                                "; make the plan again with this `voxel_size`");
    }

    /// The solution with the joined states of all bricks as its level set.
    [[nodiscard]] Solution join(const BrickPlan& plan, const BrickStates& states) const {
        Solution solution = solution_on(plan);
        StartFacts& facts = solution.start;
        solution.u = bricks::assemble(plan, plan.domain, all_of(plan), states);
        if (field) {
            facts.origin = StartOrigin::Cloud;
            facts.cloud = cloud;
            cloud::settle(*solution.u, *resolved.choices.cloud, facts.cloud, run);
            if (!is_final_start(problem, facts, EdgeFeature::Slope))
                solution.u = start_from_grid(plan.domain, *solution.u, run);
        }
        solution.solve = steady_report(*solution.u);
        return solution;
    }

    /// Extracts the surface brick by brick, so that only its level set is in memory as a whole, and u only if fields
    /// are requested.
    /// @param solution  receives the size of the band, and u if fields are requested
    [[nodiscard]] FloatGridPtr join_surfaces(const BrickPlan& plan, const BrickStates& states,
                                             Solution& solution) const {
        FloatGridPtr surface = make_grid(plan.domain, float(kHalfWidthVoxels * plan.domain.voxel_size), "surface");
        surface->setGridClass(openvdb::GRID_LEVEL_SET);
        const Clip clip = problem.clip();
        solution.solve.stop_reason = StopReason::Steady;
        for (std::size_t n = 0; n < plan.bricks.size(); ++n) {
            run.check();
            run.report("join", double(n) / double(plan.bricks.size()));
            const VoxelBox& core = plan.bricks[n].core;
            const Domain part = bricks::around(plan.domain, core, kSurfaceLayers);
            const FloatGridPtr u = bricks::assemble(plan, part, bricks_reaching(plan, part), states);
            if (u->tree().leafCount() == 0) continue;
            bricks::count(*u, core, solution.solve.active_voxels, solution.solve.leaf_count);
            set_clip(*u, clip);
            try {
                bricks::copy_leaves(*extract_surface(*u, run), core, *surface);
            } catch (const NoSurface&) {  // a neighbour's band reaches this brick, but no surface does
            }
        }
        detail::flood_tiles(*surface, plan.domain);
        if (problem.options.without_fields) return surface;
        solution.u = bricks::assemble(plan, plan.domain, all_of(plan), states);
        set_clip(*solution.u, clip);
        return surface;
    }

    /// The solution of all bricks, without its level set u.
    [[nodiscard]] Solution solution_on(const BrickPlan& plan) const {
        Solution solution;
        solution.start = facts_of_brick(resolved.choices, plan.domain, resolved.marks.attracting);
        solution.start.flow = resolved.choices.evolve;
        solution.edges.options = field ? resolved.choices.edge : plan.edge;
        return solution;
    }

    /// Edge length of a coarse voxel in fine voxels: the smallest power of two, at least kMinFactor, for which the
    /// bounding box of the marks (without marks, the image's box) is at most kCoarseVoxels coarse voxels long.
    [[nodiscard]] double coarse_factor() const {
        const std::vector<Vec3>& attracting = resolved.marks.attracting;
        const WorldBox box = attracting.empty() ? problem.image->geometry().world_box() : bounding_box(attracting);
        double factor = kMinFactor;
        while (longest_side(box) > kCoarseVoxels * factor * h()) factor *= 2;
        return factor;
    }

    void plan_cloud(BrickPlan& plan) const {
        plan.has_sweeps = false;
        plan.domain = choose_cloud_domain(problem, h(), resolved.marks.attracting);
        Domain lattice = plan.domain;
        lattice.voxel_size *= coarse_factor();
        plan.coarse = surface_from_cloud(covering(lattice, plan.domain.world_box()), *resolved.choices.cloud, run).u;
    }

    void plan_flow(BrickPlan& plan) const {
        SegmentOptions coarse_options = options;
        coarse_options.voxel_size_may_grow = false;
        coarse_options.without_mesh = true;
        coarse_options.holes = {};
        coarse_options.extract = {};
        coarse_options.without_fields = false;
        // The solve may fail if the structure is too fine for the coarse lattice. It is then repeated on a lattice with
        // half the voxel size.
        for (double factor = coarse_factor();; factor /= 2) {
            coarse_options.voxel_size = factor * h();
            try {
                const SegmentResult coarse =
                    image ? segment(*image, points, coarse_options, run) : reconstruct(points, coarse_options, run);
                plan.coarse = coarse.u;
                plan.domain = fine_domain(problem, resolved, coarse.report.domain);
                break;
            } catch (const Error& error) {
                if (error.code() == Errc::Cancelled || factor <= kMinFactor) throw;
                run.info("coarse solve at " + number(*coarse_options.voxel_size) + ": " + error.what());
            }
        }
        plan.edge = fixed_edge(problem, resolved.choices, *plan.coarse, plan.domain);
    }
};

BrickJob::BrickJob(const Image& image, const std::vector<Vec3>& points, const SegmentOptions& options,
                   const RunContext& run)
    : parts_(std::make_unique<Parts>(image, points, options, run)) {}

BrickJob::BrickJob(const std::vector<Vec3>& points, const SegmentOptions& options, const RunContext& run)
    : parts_(std::make_unique<Parts>(std::nullopt, points, options, run)) {}

BrickJob::~BrickJob() = default;

BrickPlan BrickJob::plan(const BrickOptions& options) const {
    require_valid(options, "bricks");
    BrickPlan plan;
    plan.options = options;
    with_threads(parts_->run, [&] {
        parts_->field ? parts_->plan_cloud(plan) : parts_->plan_flow(plan);
        plan.coarse->setName("coarse");
        plan.bricks = bricks::split(plan.domain, *plan.coarse, options);
    });
    return plan;
}

SolvedBrick BrickJob::solve(const BrickPlan& plan, std::size_t brick, const BrickStates& states) const {
    const RunContext& run = parts_->run;
    const Resolved& resolved = parts_->resolved;
    parts_->require_plan_of_this_job(plan);
    const VoxelBox core = plan.bricks.at(brick).core;
    const Domain kept = bricks::around(plan.domain, core, kStateLayers);
    SolvedBrick result;
    FloatGridPtr& state = result.state = make_grid(kept, float(kHalfWidthVoxels * plan.domain.voxel_size), "u");
    with_threads(run, [&] {
        const Timed timed(result.seconds);
        result.stop_reason = StopReason::Steady;
        if (parts_->field) {
            state = parts_->field->on(bricks::around(plan.domain, core, 0), run);
            result.active_voxels = std::int64_t(state->activeVoxelCount());
            return;
        }
        const Domain part = bricks::around(plan.domain, core, plan.options.overlap);
        StartSurface start;
        start.u = start_of(plan, brick, states, part, run);
        if (!start.u) return;
        start.facts = facts_of_brick(resolved.choices, part, points_near(resolved, part));
        const bricks::Frame frame = bricks::make_frame(*start.u, part, plan.domain);
        start.floor = frame.floor;
        start.obstacle = frame.obstacle;
        start.distance = find_distance_for_flow(start.facts, *start.u, start.facts.report, run);
        const Solution solution = flow(parts_->problem, std::move(start), plan.edge);
        result.stop_reason = solution.solve.stop_reason;
        result.steps = solution.solve.steps;
        result.active_voxels = solution.solve.active_voxels;
        if (solution.has_vanished()) return;
        solution.u->setName("u");
        state = bricks::leaves_within(*solution.u, {kept.min, kept.max});
        set_domain(*state, kept);
    });
    return result;
}

SegmentResult BrickJob::join(const BrickPlan& plan, const BrickStates& states, bool without_mesh) const {
    const RunContext& run = parts_->run;
    const Choices& choices = parts_->resolved.choices;
    parts_->require_plan_of_this_job(plan);
    SegmentOptions options = parts_->options;
    options.without_mesh = options.without_mesh || without_mesh;
    const Problem problem(parts_->problem.image, parts_->points, options, run);
    SegmentResult result;
    with_threads(run, [&] {
        StepReport before = choices.report;
        if (!choices.cloud) before.remarks.add(doubt_isolated_marks(problem));
        // The surface is extracted brick by brick and joined, even if u is requested and joined as well, so that it is
        // bitwise equal in both cases. The surface of a cloud, which does not evolve, follows from the cloud's field.
        FloatGridPtr surface;
        Solution solution = parts_->field ? parts_->join(plan, states) : parts_->solution_on(plan);
        if (!parts_->field) surface = parts_->join_surfaces(plan, states, solution);
        if (solution.solve.leaf_count == 0)
            throw Error(Errc::InvalidInput,
                        "bricks: the surface vanished in all bricks; lower `delta`, or start closer to the points or "
                        "edges (`init`)",
                        "delta");
        solution.report.remarks.choose("bricks", std::to_string(plan.bricks.size()), "solved separately and joined",
                                       run);
        Surface made = make_surface(problem, choices, solution, surface);
        result.report = measure(problem, choices, before, solution, made);
        result.u = std::move(made.u);
        result.surface = std::move(made.level_set);
        result.mesh = std::move(made.mesh);
        result.distance_to_points = std::move(made.distance_to_points);
    });
    return result;
}

}  // namespace covol
