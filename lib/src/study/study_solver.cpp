#include "covol/study_solver.h"

#include <sys/resource.h>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>
#include <unistd.h>

#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <unordered_map>
#include <utility>

#include "covol/error.h"
#include "covol/segment_structures.h"
#include "covol/surface.h"

namespace covol {
namespace {

constexpr std::size_t kFewestMarks = 4;  // fewer do not determine a surface
constexpr double kManyVoxels = 1e5;      // in a band; with more, the first surface gets larger voxels

/// Lowers the priority of threads that compute surfaces below that of threads that serve a page, and of the browser on
/// the same cores.
class LowerPriority : public tbb::task_scheduler_observer {
public:
    explicit LowerPriority(tbb::task_arena& arena) : tbb::task_scheduler_observer(arena) { observe(true); }
    void on_scheduler_entry(bool /*is_worker*/) override {
        constexpr int kNice = 5;  // if the cores do not suffice, a third of the time of other threads
        static thread_local const int done = ::setpriority(PRIO_PROCESS, id_t(::gettid()), kNice);
        (void)done;
    }
};

/// The threads of all solvers of this process. It is never destroyed: TBB does not free an observer that ends while a
/// thread is still leaving its arena.
tbb::task_arena& low_priority_arena() {
    struct Observed {
        tbb::task_arena arena;
        LowerPriority lower{arena};
    };
    static Observed& observed = *new Observed;
    return observed.arena;
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Whether positions lie in one plane, up to a thousandth of their extent, such as clicks on one slice.
bool are_flat(const std::vector<Vec3>& places) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Vec3& p : places) mean += Eigen::Vector3d(p[0], p[1], p[2]) / double(places.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Vec3& p : places) {
        const Eigen::Vector3d off = Eigen::Vector3d(p[0], p[1], p[2]) - mean;
        spread += off * off.transpose();
    }
    const Eigen::Vector3d squares = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues();
    return squares[0] <= 1e-6 * squares[2];
}

/// Whether all paint is on one slice.
bool is_on_one_slice(const std::vector<StudyStroke>& strokes) {
    const StudyStroke* first = nullptr;
    for (const StudyStroke& stroke : strokes) {
        if (stroke.erases) continue;
        if (!stroke.axis || (first != nullptr && (stroke.axis != first->axis || stroke.at != first->at))) return false;
        first = &stroke;
    }
    return first != nullptr;
}

/// Describes what is missing for a surface; empty if nothing is.
std::string missing(const StudyStructure& structure) {
    // With outlines or a guess nothing is checked here: if they are not sufficient, the segmentation reports it.
    if (!structure.outlines.empty() || structure.guess) return {};
    if (!structure.strokes.empty())
        return structure.marks.empty() && is_on_one_slice(structure.strokes)
                   ? "paint a second slice, or set marks beside this one, to get a surface"
                   : "";
    std::vector<Vec3> places;
    for (const StudyMark& mark : structure.marks)
        if (mark.kind == MarkKind::Surface) places.push_back(mark.world);
    if (places.size() >= kFewestMarks)
        return are_flat(places) ? "all marks lie in one plane: set some on other slices, or in another view" : "";
    const std::size_t more = kFewestMarks - places.size();
    return std::to_string(more) +
           (more == 1 ? " more mark is needed for a surface" : " more marks are needed for a surface");
}

/// Estimated number of voxels of edge h in the band: as for the previous surface, else as for a body that fills the box
/// of the marks.
double voxels_of_band(const StudyStructure& structure, const SegmentResult* before, double h) {
    if (before != nullptr) {
        const double own = before->report.domain.voxel_size;
        return double(before->report.active_voxels) * own * own / (h * h);
    }
    std::vector<Vec3> places;
    for (const StudyMark& mark : structure.marks)
        if (mark.kind == MarkKind::Surface) places.push_back(mark.world);
    for (const StudyOutline& outline : structure.outlines)
        places.insert(places.end(), outline.world.begin(), outline.world.end());
    if (places.empty()) return 0;  // only a guess or paint
    const WorldBox box = bounding_box(places);
    double area = 0;
    for (std::size_t a = 0; a < 3; ++a)
        area += 2 * (box.max[a] - box.min[a]) * (box.max[(a + 1) % 3] - box.min[(a + 1) % 3]);
    return 2 * kHalfWidthVoxels * area / (h * h);
}

}  // namespace

struct StudySolver::State {
    struct Job {
        std::shared_ptr<const StudyStructure> structure;
        std::uint64_t sequence = 0;
        bool is_known = false;  ///< the caller already has its surface: confirm()
    };

    State(std::function<Image()> i, SegmentOptions o, std::function<void(const StudyResult&)> t, const RunContext& r,
          std::function<GivenGuess(const StudyGuess&, const RunContext&)> read_guess)
        : image(std::move(i)), site{image().geometry(), std::move(read_guess)}, on_result(std::move(t)), run(r) {
        run.cancel = &cancel;
        set_options(std::move(o));
    }
    /// @pre `mutex` is locked, or no solver is running
    void set_options(SegmentOptions o) {
        options = std::move(o);
        if (options.voxel_size) return;
        if (!automatic_voxel_size) automatic_voxel_size = choose_voxel_size(image()).voxel_size;
        options.voxel_size = automatic_voxel_size;
    }

    void work() {
        std::unique_lock lock(mutex);
        for (;;) {
            changed.wait(lock, [&] { return is_stopping || !waiting.empty(); });
            if (is_stopping) return;
            const Job job = waiting.front();
            waiting.pop_front();
            running = job.structure->id;
            is_obsolete = false;
            cancel = false;
            const SegmentOptions how = options;
            lock.unlock();
            const bool is_done = low_priority_arena().execute([&] { return solve(job, how); });
            lock.lock();
            running = 0;
            if (!is_done && !is_obsolete && !is_stopping) waiting.push_back(job);  // it was interrupted
            changed.notify_all();
        }
    }

    /// Computes and publishes the surface of a structure. @return false if cancelled
    bool solve(const Job& job, const SegmentOptions& refined) {
        StudyResult result;
        result.structure = job.structure->id;
        result.sequence = job.sequence;
        const auto publish = [&](StudyResult::Stage stage) {
            result.stage = stage;
            on_result(result);
        };
        result.message = missing(*job.structure);
        if (!result.message.empty()) {
            keep(result.structure, nullptr);
            publish(StudyResult::Stage::Empty);
            return true;
        }
        const auto begin = std::chrono::steady_clock::now();
        publish(StudyResult::Stage::Working);
        Image pixels;
        const auto find = [&](const SegmentOptions& how, const Marks& marks, StudyResult::Stage stage) {
            RunContext own = run;
            own.progress = [&, last = begin](const std::string&, double fraction) mutable {
                const auto now = std::chrono::steady_clock::now();
                if (now - last < std::chrono::milliseconds(200)) return;
                last = now;
                result.progress = fraction;
                publish(StudyResult::Stage::Working);
            };
            StructuresResult all = segment_structures(pixels, {marks}, {how, {}}, own);
            SegmentResult found = std::move(all.structures.front().result);
            if (found.mesh.empty()) found.mesh = extract_mesh(*found.surface, {}, own);
            result.surface = std::make_shared<const SegmentResult>(std::move(found));
            result.version = ++versions;
            result.seconds = seconds_since(begin);
            keep(result.structure, result.surface);
            publish(stage);
            result.surface.reset();
        };
        try {
            pixels = image();
            const Marks marks = marks_of(*job.structure, site);
            if (job.is_known) {
                find(refined, marks, StudyResult::Stage::Refined);
                return true;
            }
            SegmentOptions first = refined;
            first.evolve.rho = 0;
            first.without_mesh = first.without_fields = true;  // a relaxed mesh would take as long as the surface
            Marks moved = marks;
            const auto before = newest(result.structure);
            if (before) {
                first.guess = LevelSetStart{before->surface};
                moved.guess = nullptr;
            }
            if (voxels_of_band(*job.structure, before.get(), *first.voxel_size) > kManyVoxels) *first.voxel_size *= 2;
            try {
                find(first, moved, StudyResult::Stage::First);
            } catch (const Error& error) {
                if (error.code() == Errc::Cancelled) throw;  // the next attempt, which uses the image, may succeed
            }
            find(refined, marks, StudyResult::Stage::Refined);
        } catch (const Error& error) {
            if (error.code() == Errc::Cancelled) return false;
            result.message = error.what();
            publish(StudyResult::Stage::Failed);
        } catch (const std::exception& error) {
            result.message = error.what();
            publish(StudyResult::Stage::Failed);
        }
        return true;
    }

    void keep(StudyId structure, std::shared_ptr<const SegmentResult> surface) {
        const std::lock_guard lock(mutex);
        if (is_obsolete) return;
        if (surface)
            surfaces[structure] = std::move(surface);
        else
            surfaces.erase(structure);
    }
    [[nodiscard]] std::shared_ptr<const SegmentResult> newest(StudyId structure) const {
        const std::lock_guard lock(mutex);
        const auto found = surfaces.find(structure);
        return found != surfaces.end() ? found->second : nullptr;
    }
    /// Discards the waiting and the running jobs of a structure. @pre `mutex` is locked
    void drop(StudyId structure) {
        std::erase_if(waiting, [&](const Job& job) { return job.structure->id == structure; });
        if (running == structure) is_obsolete = true;
    }

    const std::function<Image()> image;
    const StudySite site;
    SegmentOptions options;
    std::optional<double> automatic_voxel_size;
    const std::function<void(const StudyResult&)> on_result;
    RunContext run;
    std::atomic<bool> cancel{false};
    mutable std::mutex mutex;
    mutable std::condition_variable changed;
    std::deque<Job> waiting;
    StudyId running = 0;
    bool is_obsolete = false, is_stopping = false;
    std::unordered_map<StudyId, std::shared_ptr<const SegmentResult>> surfaces;
    std::uint64_t versions = 0;
    std::thread worker;
};

StudySolver::StudySolver(std::function<Image()> image, SegmentOptions options,
                         std::function<void(const StudyResult&)> on_result, const RunContext& run,
                         std::function<GivenGuess(const StudyGuess&, const RunContext&)> read_guess)
    : state_(std::make_unique<State>(std::move(image), std::move(options), std::move(on_result), run,
                                     std::move(read_guess))) {
    state_->worker = std::thread([state = state_.get()] { state->work(); });
}

StudySolver::~StudySolver() {
    {
        const std::lock_guard lock(state_->mutex);
        state_->is_stopping = true;
        state_->cancel = true;
    }
    state_->changed.notify_all();
    state_->worker.join();
}

void StudySolver::set_options(SegmentOptions options) {
    const std::lock_guard lock(state_->mutex);
    state_->set_options(std::move(options));
}

void StudySolver::solve(std::shared_ptr<const StudyStructure> structure, std::uint64_t sequence) {
    {
        const std::lock_guard lock(state_->mutex);
        state_->drop(structure->id);
        state_->waiting.push_front({std::move(structure), sequence, false});
        state_->cancel = true;
    }
    state_->changed.notify_all();
}

void StudySolver::confirm(std::shared_ptr<const StudyStructure> structure, std::uint64_t sequence) {
    {
        const std::lock_guard lock(state_->mutex);
        state_->drop(structure->id);
        state_->waiting.push_back({std::move(structure), sequence, true});
    }
    state_->changed.notify_all();
}

void StudySolver::forget(StudyId structure) {
    {
        const std::lock_guard lock(state_->mutex);
        state_->drop(structure);
        if (state_->running == structure) state_->cancel = true;
        state_->surfaces.erase(structure);
    }
    state_->changed.notify_all();
}

std::shared_ptr<const SegmentResult> StudySolver::surface(StudyId structure) const { return state_->newest(structure); }

void StudySolver::wait() const {
    std::unique_lock lock(state_->mutex);
    state_->changed.wait(lock, [&] { return state_->waiting.empty() && state_->running == 0; });
}

}  // namespace covol
