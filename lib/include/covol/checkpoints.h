#pragma once
#include <memory>
#include <string>

#include "covol/api.h"

namespace covol {

/// Saves the states of a run's flows to disk at intervals: a run that was killed resumes from them and ends with
/// bit-identical results. Each flow has a number, in the order of the calls of evolve(), which has to be the same in
/// each run. What a run computes before a flow and between two flows (tags, distances, edges) is not saved but computed
/// again.
///
/// Flow N is stored in flow-N.vdb (u, and the edges if the band has reached new ones; meant for viewing) and
/// flow-N.state; both are put in place together.
class COVOL_API Checkpoints {
public:
    /// @param folder  created if it does not exist
    /// @param every   seconds between two states of a flow; 0: one after each step
    /// @param job     identifies this run: version, options, digests of the inputs
    /// @param resume  whether the run resumes from states in the folder
    /// @throws Error Io; InvalidInput (states of another job; any states, if not `resume`).
    Checkpoints(const std::string& folder, double every, const std::string& job, bool resume);
    ~Checkpoints();
    Checkpoints(const Checkpoints&) = delete;
    Checkpoints& operator=(const Checkpoints&) = delete;

    /// Whether the folder contained states.
    [[nodiscard]] bool had_states() const noexcept;
    /// Called once the results are in place: removes the files written here, and the folder if nothing else is in it.
    void remove() noexcept;

    // For evolve():
    /// The next flow's number, from 1.
    [[nodiscard]] int begin_flow();
    /// "FOLDER/flow-03.vdb"
    [[nodiscard]] std::string file(int flow, const char* ending) const;
    [[nodiscard]] bool is_due() const;
    /// Called after a state was written.
    void restart_clock();

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace covol
