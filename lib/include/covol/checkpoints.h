#pragma once
#include <memory>
#include <string>

#include "covol/api.h"

namespace covol {

/// The state of a run's flows on disk, at intervals: a run that was killed goes on from it and ends with the same bits.
/// Each flow has a number, in the order of evolve()'s calls, which has to be the same each time; what a run computes
/// before a flow and between two of them (tags, distances, edges) it computes again.
///
/// Of flow N there are flow-N.vdb (u, and the edges where the band has reached new ones: files to look at) and
/// flow-N.state, which are put in place together.
class COVOL_API Checkpoints {
public:
    /// @param folder  made where it is not there
    /// @param every   seconds between two states of a flow; 0: one after each step
    /// @param job     what tells this run from others: version, options, digests of the inputs
    /// @param resume  whether the run goes on from states that the folder holds
    /// @throws Error Io; InvalidInput (states of another job, or without `resume` of any).
    Checkpoints(const std::string& folder, double every, const std::string& job, bool resume);
    ~Checkpoints();
    Checkpoints(const Checkpoints&) = delete;
    Checkpoints& operator=(const Checkpoints&) = delete;

    /// Whether the folder had states.
    [[nodiscard]] bool had_states() const noexcept;
    /// Once the results are in place: removes what was written here, and the folder where nothing else is in it.
    void remove() noexcept;

    // For evolve():
    /// The next flow's number, from 1.
    [[nodiscard]] int begin_flow();
    /// "FOLDER/flow-03.vdb"
    [[nodiscard]] std::string file(int flow, const char* ending) const;
    [[nodiscard]] bool is_due() const;
    /// A state was written.
    void restart_clock();

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace covol
