#pragma once
#include <optional>
#include <string>
#include <vector>

#include "cli/options/job_options.h"
#include "cli/session.h"
#include "covol/bricks.h"
#include "covol/vdb_io.h"

namespace covol::tool {

/// The folder of a job in bricks: plan.json, coarse.vdb, and for each sweep N and brick B sweep-N/brick-B.vdb with the
/// state and sweep-N/brick-B.json, whose existence marks it as done. Files are complete or absent; those that are done
/// are never written again.
class BrickFolder {
public:
    explicit BrickFolder(std::string path) : path_(std::move(path)) {}

    /// Creates the folder. @throws Error InvalidOptions if it already contains a plan, Io.
    void write_plan(const BrickPlan& plan, const JobOptions& job, const std::vector<std::string>& inputs,
                    const WriteVdbOptions& options) const;
    /// A plan may come from an untrusted source: all its numbers are validated.
    /// @throws Error InvalidInput (damaged; the size of an input has changed), Io.
    [[nodiscard]] BrickPlan read_plan() const;

    [[nodiscard]] bool is_done(int sweep, std::size_t brick) const;
    /// The state after a sweep, or null.
    [[nodiscard]] FloatGridPtr state(int sweep, std::size_t brick) const;
    void write_state(int sweep, std::size_t brick, const FloatGridPtr& state, Json facts) const;
    /// The state is the same as after the previous sweep.
    void write_same(int sweep, std::size_t brick, Json facts) const;
    /// Whether a completed sweep changed the brick's state.
    [[nodiscard]] bool moved(int sweep, std::size_t brick) const { return sweep_of_state(sweep, brick) == sweep; }
    /// The cost of the sweeps up to this one.
    struct Spent {
        int steps = 0;  ///< maximum over bricks
        double seconds = 0;
        std::size_t unsteady = 0;  ///< bricks whose flow was not steady at its last step
    };
    [[nodiscard]] Spent spent(int sweep, std::size_t bricks) const;
    /// The last sweep that is done for all bricks; 0: none.
    [[nodiscard]] int last_sweep(std::size_t bricks) const;
    /// The states of a sweep, as a function of the brick. The folder must outlive it.
    [[nodiscard]] BrickStates states(int sweep) const;
    [[nodiscard]] const std::string& path() const noexcept { return path_; }

private:
    [[nodiscard]] std::string name(int sweep, std::size_t brick, const char* ending) const;
    /// The sweep whose .vdb contains the state after `sweep`; 0: none.
    [[nodiscard]] int sweep_of_state(int sweep, std::size_t brick) const;
    std::string path_;
};

}  // namespace covol::tool
