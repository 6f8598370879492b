#pragma once
#include <optional>
#include <string>
#include <vector>

#include "cli/job_options.h"
#include "cli/session.h"
#include "covol/bricks.h"
#include "covol/vdb_io.h"

namespace covol::tool {

/// The folder of a job in bricks: plan.json, coarse.vdb, and for each sweep N and brick B sweep-N/brick-B.vdb with the
/// state and sweep-N/brick-B.json, which says that it is done. Each file is whole or absent; those that are done are
/// never written again.
class BrickFolder {
public:
    explicit BrickFolder(std::string path) : path_(std::move(path)) {}

    /// Makes the folder. @throws Error InvalidOptions where it has a plan already, Io.
    void write_plan(const BrickPlan& plan, const JobOptions& job, const std::vector<std::string>& inputs,
                    const WriteVdbOptions& options) const;
    /// A plan may be a stranger's: every number in it is one that a plan can have.
    /// @throws Error InvalidInput (damaged; an input that is not as large as it was), Io.
    [[nodiscard]] BrickPlan read_plan() const;

    [[nodiscard]] bool is_done(int sweep, std::size_t brick) const;
    /// The state after a sweep, or null.
    [[nodiscard]] FloatGridPtr state(int sweep, std::size_t brick) const;
    void write_state(int sweep, std::size_t brick, const FloatGridPtr& state, Json facts) const;
    /// The state is as after the sweep before.
    void write_same(int sweep, std::size_t brick, Json facts) const;
    /// Whether a sweep that is done changed the brick's state.
    [[nodiscard]] bool moved(int sweep, std::size_t brick) const { return sweep_of_state(sweep, brick) == sweep; }
    /// What the sweeps up to this one took.
    struct Spent {
        int steps = 0;  ///< of the brick that took most
        double seconds = 0;
        std::size_t unsteady = 0;  ///< bricks whose flow ended at its last step
    };
    [[nodiscard]] Spent spent(int sweep, std::size_t bricks) const;
    /// The last sweep that all of so many bricks have done; 0: none.
    [[nodiscard]] int last_sweep(std::size_t bricks) const;
    /// Of a sweep, as a function of the brick. The folder has to outlive it.
    [[nodiscard]] BrickStates states(int sweep) const;
    [[nodiscard]] const std::string& path() const noexcept { return path_; }

private:
    [[nodiscard]] std::string name(int sweep, std::size_t brick, const char* ending) const;
    /// The sweep whose .vdb has the state after `sweep`; 0: none.
    [[nodiscard]] int sweep_of_state(int sweep, std::size_t brick) const;
    std::string path_;
};

}  // namespace covol::tool
