#pragma once
#include <optional>
#include <string>
#include <vector>

#include "cli/options/job_options.h"
#include "cli/session.h"
#include "covol/bricks.h"
#include "covol/vdb_io.h"

namespace covol::tool {

/// The folder of a job in bricks. It contains plan.json, coarse.vdb, and for each sweep N and brick B the file
/// sweep-N/brick-B.json, which exists when the sweep is done for the brick, and the state of the brick in
/// sweep-N/brick-B.vdb if the sweep changed it. Files are written completely or not at all, and are never replaced.
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
    /// The state of a brick after a sweep; null if the brick has not been solved.
    [[nodiscard]] FloatGridPtr state(int sweep, std::size_t brick) const;
    void write_state(int sweep, std::size_t brick, const FloatGridPtr& state, Json facts) const;
    /// Records that the state of the brick is the same as after the previous sweep.
    void write_same(int sweep, std::size_t brick, Json facts) const;
    /// Whether a completed sweep changed the brick's state.
    [[nodiscard]] bool moved(int sweep, std::size_t brick) const { return sweep_of_state(sweep, brick) == sweep; }
    /// The cost of all sweeps from the first to a given one.
    struct Spent {
        int steps = 0;  ///< steps of the brick with the maximum number of steps
        double seconds = 0;
        std::size_t unsteady = 0;  ///< number of bricks whose last flow ended at the maximum number of steps
    };
    [[nodiscard]] Spent spent(int sweep, std::size_t bricks) const;
    /// The number of the last sweep that is done for all bricks; 0: none.
    [[nodiscard]] int last_sweep(std::size_t bricks) const;
    /// A function that returns the state of a brick after `sweep`. This object must outlive it.
    [[nodiscard]] BrickStates states(int sweep) const;
    [[nodiscard]] const std::string& path() const noexcept { return path_; }

private:
    [[nodiscard]] std::string name(int sweep, std::size_t brick, const char* ending) const;
    /// The sweep whose .vdb contains the state after `sweep`; 0: none.
    [[nodiscard]] int sweep_of_state(int sweep, std::size_t brick) const;
    std::string path_;
};

}  // namespace covol::tool
