#include "jobs/brick_job.h"

#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <memory>
#include <numeric>
#include <sstream>

#include "cli/output/bytes_text.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "covol/mesh_stream.h"
#include "jobs/brick_folder.h"
#include "jobs/timelapse_job.h"

namespace covol::tool {
namespace {

constexpr double kSmallJob = 64;  // voxels; a job is not split if the longest side of its box is shorter

std::unique_ptr<BrickJob> make_job(const std::optional<Image>& image, const StructureInput& structure,
                                   const RunContext& run) {
    if (image) return std::make_unique<BrickJob>(*image, structure.points, structure.options, run);
    return std::make_unique<BrickJob>(structure.points, structure.options, run);
}

/// Solves bricks of a plan, sweep by sweep.
class BrickRunner {
public:
    BrickRunner(const BrickJob& job, const BrickPlan& plan, const BrickFolder& folder, const RunContext& run)
        : job_(job), plan_(plan), folder_(folder), run_(run) {}

    /// @return the number of bricks whose state changed
    [[nodiscard]] std::size_t run_sweep(int sweep, const std::vector<std::size_t>& bricks) const {
        std::size_t moved = 0;
        const auto total = double(std::max<std::int64_t>(1, plan_.active_voxels()));
        double done = 0;
        for (const std::size_t brick : bricks) {
            run_.check();
            run_.report("bricks, sweep " + std::to_string(sweep), done / total);
            moved += solve(sweep, brick);
            done += double(plan_.bricks[brick].active_voxels);
        }
        return moved;
    }

    /// Solves all bricks in repeated sweeps until neighbours agree, or until the maximum number of sweeps.
    void run_all() const {
        std::vector<std::size_t> all(plan_.bricks.size());
        std::iota(all.begin(), all.end(), std::size_t(0));
        const int maximum = plan_.has_sweeps ? plan_.options.max_sweeps : 1;
        for (int sweep = 1; sweep <= maximum; ++sweep) {
            const std::size_t moved = run_sweep(sweep, all);
            run_.info("sweep " + std::to_string(sweep) + ": " + std::to_string(moved) + " of " +
                      std::to_string(all.size()) + " bricks solved");
            if (moved == 0) return;
        }
        if (plan_.has_sweeps)
            run_.info("neighbours do not agree within --seam-tolerance after " + std::to_string(maximum) + " sweeps");
    }

private:
    /// Solves one brick in one sweep. @return false if its state is the same as after the previous sweep
    [[nodiscard]] bool solve(int sweep, std::size_t brick) const {
        if (folder_.is_done(sweep, brick)) return folder_.moved(sweep, brick);
        const BrickStates states = folder_.states(sweep - 1);
        Json facts;
        if (sweep > 1) {
            for (const std::size_t n : with_neighbours(brick))
                if (!folder_.is_done(sweep - 1, n))
                    throw Error(Errc::InvalidInput, folder_.path() + ": brick " + std::to_string(brick) + " in sweep " +
                                                        std::to_string(sweep) + " needs brick " + std::to_string(n) +
                                                        " of sweep " + std::to_string(sweep - 1) + ": run that first");
            const double gap = measure_seams(plan_, brick, states);
            facts["gap"] = gap;
            if (!plan_.has_sweeps || gap < plan_.options.tolerance) {
                folder_.write_same(sweep, brick, facts);
                return false;
            }
        }
        const SolvedBrick solved = job_.solve(plan_, brick, states);
        run_.check();  // throws if cancelled: the state would be invalid
        facts.update({{"steps", solved.steps},
                      {"stop_reason", to_string(solved.stop_reason)},
                      {"active_voxels", solved.active_voxels},
                      {"seconds", solved.seconds},
                      {"peak_rss_bytes", peak_rss()}});
        folder_.write_state(sweep, brick, solved.state, facts);
        return true;
    }

    [[nodiscard]] std::vector<std::size_t> with_neighbours(std::size_t brick) const {
        std::vector<std::size_t> all = plan_.bricks[brick].neighbours;
        all.push_back(brick);
        return all;
    }

    const BrickJob& job_;
    const BrickPlan& plan_;
    const BrickFolder& folder_;
    const RunContext& run_;
};

/// A context without progress and remarks, for single bricks; warnings are passed on.
RunContext quiet(const RunContext& run) {
    RunContext inner = run;
    inner.progress = {};
    inner.log = [log = run.log](LogLevel level, const std::string& line) {
        if (level == LogLevel::Warning && log) log(level, line);
    };
    return inner;
}

/// [voxels] A warning is printed if the surfaces of neighbouring bricks are farther apart than this. If they are
/// closer, their mean is used without a warning.
constexpr double kWarnOfGap = 0.5;

void report_seams(const BrickPlan& plan, const BrickFolder& folder, int sweep, Session& session) {
    double gap = 0;
    for (std::size_t n = 0; n < plan.bricks.size(); ++n)
        gap = std::max(gap, measure_seams(plan, n, folder.states(sweep)));
    session.report()["bricks"] = {{"count", plan.bricks.size()}, {"sweeps", sweep}, {"largest_gap", gap}};
    std::ostringstream text;
    text << std::setprecision(2) << "neighbouring bricks lie up to " << gap << " voxels apart after sweep " << sweep;
    if (gap > kWarnOfGap)
        session.warn(text.str() + (session.brick()
                                       ? ": run the next sweep, covol brick run " + folder.path() + " --sweep " +
                                             std::to_string(sweep + 1) + ", and join again"
                                       : "; their mean is taken: check the surface there, or use larger bricks "
                                         "(--memory-limit, --brick-voxels)"));
    else
        session.note(text.str() + "; their mean is taken");
}

/// The rounded number as text: "about 12 million voxels".
std::string about_voxels(std::int64_t count) {
    constexpr std::int64_t kMillion = 1'000'000, kThousand = 1'000;
    const auto rounded = [&](std::int64_t unit) { return std::to_string((count + unit / 2) / unit); };
    if (count >= 10 * kMillion) return "about " + rounded(kMillion) + " million voxels";
    return "about " + (count < kThousand ? std::to_string(count) : rounded(kThousand) + "000") + " voxels";
}

/// Whether the mesh is streamed, that is, written triangle by triangle without being held in memory, because of --plain
/// or because there is not enough memory for the whole mesh.
/// @throws Error if the memory does not suffice even then, or if the mesh would have to be streamed but cannot be
bool streams_mesh(const SegmentJob& job, const BrickPlan& plan, const Session& session) {
    const auto voxels = double(plan.active_voxels()), limit = double(session.run().memory_budget);
    if (job.mesh.plain || memory_of_joined_mesh(voxels) < limit) return job.mesh.plain;
    const auto refuse = [&](double bytes, const std::string& what) {
        throw Error(Errc::InvalidOptions, "bricks: " + what + " of a band of " + about_voxels(plan.active_voxels()) +
                                              " takes about " + bytes_text(bytes) + ", more than the " +
                                              bytes_text(limit) + " that are free or allowed by --memory-limit");
    };
    if (memory_of_joined(voxels) > limit)
        refuse(memory_of_joined(voxels), "the joined level set (covol brick can join it on another machine)");
    if (job.evidence.wanted() || needs_mesh(job.given.options.holes.policy) || job.given.has("min_component"))
        refuse(
            memory_of_joined_mesh(voxels),
            "the whole mesh, which --evidence, --suggest, --suggestions, --report, --holes and --min-component need,");
    if (!job.mesh_path.empty() && !can_stream_mesh(job.mesh_path))
        refuse(memory_of_joined_mesh(voxels), "the whole mesh (.ply, .stl and .obj can be streamed)");
    return true;
}

SegmentResult join(const SegmentJob& given, BrickJob& job, const BrickPlan& plan, const BrickFolder& folder,
                   Session& session) {
    const bool without_mesh = streams_mesh(given, plan, session);
    const int sweep = folder.last_sweep(plan.bricks.size());
    if (sweep == 0)
        throw Error(Errc::InvalidInput,
                    folder.path() + ": expected a state of each brick: run covol brick run " + folder.path());
    if (plan.has_sweeps) report_seams(plan, folder, sweep, session);
    SegmentResult result = job.join(plan, folder.states(sweep), without_mesh);
    const BrickFolder::Spent spent = folder.spent(sweep, plan.bricks.size());
    result.report.solve.steps = spent.steps;
    result.report.seconds.solve += spent.seconds;
    if (spent.unsteady > 0) {
        result.report.solve.stop_reason = StopReason::MaxSteps;
        session.warn(std::to_string(spent.unsteady) + " of " + std::to_string(plan.bricks.size()) +
                     " bricks are not steady after " + std::to_string(spent.steps) + " steps; increase --max-steps" +
                     (session.brick() ? ", and plan again" : ""));
    }
    return result;
}

void print_plan(const BrickPlan& plan, Session& session) {
    std::int64_t largest = 0;
    for (const Brick& brick : plan.bricks) largest = std::max(largest, brick.active_voxels);
    const double memory = memory_of_brick(double(largest));
    Json& json = session.report()["plan"];
    json = {{"bricks", plan.bricks.size()},
            {"active_voxels", plan.active_voxels()},
            {"largest_brick", largest},
            {"memory_bytes", std::llround(memory)}};
    session.print("bricks: " + std::to_string(plan.bricks.size()) + ", band: " + about_voxels(plan.active_voxels()) +
                  ", the largest brick " + about_voxels(largest) + ", which takes about " + bytes_text(memory));
}

/// Names of the outputs that were given, except -o; empty if there are none. `covol brick plan` does not write them.
std::string outputs_of_join(const Session& session) {
    std::string names;
    for (const std::string& name : session.given())
        if (name != "output" && session.has_role(name, OptionRole::Output))
            names += (names.empty() ? "--" : ", --") + name;
    return names;
}

}  // namespace

void run_bricks(const SegmentJob& job, Session& session) {
    const BrickCall& call = *session.brick();
    std::vector<Marks> structures = structures_of(job, job.painted.read(session.run()));
    if (is_timelapse(job) || structures.size() != 1)
        throw UsageError("brick: expected one structure in one image; plan each separately");
    const BrickFolder folder(call.folder);
    if (call.step == BrickCall::Step::Join)
        return run_structures(
            job, session,
            [&](const std::optional<Image>& image, const StructureInput& structure, const RunContext& run) {
                const BrickPlan plan = folder.read_plan();
                return join(job, *make_job(image, structure, run), plan, folder, session);
            });
    job.check_settings();
    add_starts(job, structures, session.run());
    std::optional<Image> image;
    if (!job.images.empty()) image = job.read(job.images.front(), job.image.options, session);
    if (call.step == BrickCall::Step::Plan) {
        const StructureInput structure = prepare_structure(job, structures, image, session, session.run());
        const BrickPlan plan =
            make_job(image, structure, session.run())->plan(job.bricks.resolve(session.memory_limit()));
        folder.write_plan(plan, session.job(), session.provenance().inputs(), {});
        if (const std::string outputs = outputs_of_join(session); !outputs.empty())
            session.note("the plan contains only settings and inputs; give the outputs to covol brick join: " +
                         outputs);
        return print_plan(plan, session);
    }
    const RunContext inner = quiet(session.run());
    const BrickPlan plan = folder.read_plan();
    for (const std::size_t brick : call.bricks)
        if (brick >= plan.bricks.size())
            throw UsageError("brick run: expected bricks 0 to " + std::to_string(plan.bricks.size() - 1) + ", got " +
                             std::to_string(brick));
    const StructureInput structure = prepare_structure(job, structures, image, session, inner);
    const std::unique_ptr<BrickJob> solver = make_job(image, structure, inner);
    const BrickRunner runner(*solver, plan, folder, session.run());
    std::vector<std::size_t> bricks = call.bricks;
    if (bricks.empty()) {
        if (call.sweep == 0) return runner.run_all();
        bricks.resize(plan.bricks.size());
        std::iota(bricks.begin(), bricks.end(), std::size_t(0));
    }
    static_cast<void>(runner.run_sweep(std::max(1, call.sweep), bricks));
}

SegmentResult solve_within_limit(const SegmentJob& job, const std::optional<Image>& image,
                                 const StructureInput& structure, Session& session, const RunContext& run) {
    const auto in_one = [&] { return solve_structure(image, structure, run); };
    const std::optional<std::uint64_t> limit = session.memory_limit();
    if (!limit) return in_one();
    const WorldBox box = structure.points.empty() ? (image ? image->geometry().world_box() : WorldBox{})
                                                  : bounding_box(structure.points);
    if (longest_side(box) < kSmallJob * structure.options.voxel_size.value_or(1)) return in_one();
    RunContext inner = quiet(run);
    inner.checkpoints = nullptr;
    std::unique_ptr<BrickJob> solver;
    BrickPlan plan;
    try {
        solver = make_job(image, structure, inner);
        plan = solver->plan(job.bricks.resolve(limit));
    } catch (const Error& error) {
        if (error.code() == Errc::Cancelled) throw;
        return in_one();  // if the job is invalid, and not only its division into bricks, this fails, too
    }
    if (memory_of_band(double(plan.active_voxels())) < double(*limit)) {
        solver.reset();
        plan = {};
        return in_one();
    }
    if (run.checkpoints)
        throw Error(
            Errc::InvalidOptions,
            "--checkpoint, --resume: the band is larger than --memory-limit allows at once, and bricks store their own "
            "states: see covol brick");
    (void)streams_mesh(job, plan, session);  // throws now if the bricks could not be joined later
    run.info(about_voxels(plan.active_voxels()) + " in the band, more than --memory-limit allows at once: in " +
             std::to_string(plan.bricks.size()) + " bricks");
    const ScratchFolder scratch(std::filesystem::path(job.any_output()).parent_path());
    const BrickFolder folder((scratch.path() / "bricks").string());
    BrickRunner(*solver, plan, folder, run).run_all();
    return join(job, *solver, plan, folder, session);
}

}  // namespace covol::tool
