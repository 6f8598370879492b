#pragma once
#include <memory>
#include <string>

#include "covol/api.h"

namespace covol {

/// Saves the states of a run's flows to disk at intervals, so that a run that was killed can resume from them, with
/// bit-identical results. A state is recognised by the number of its flow: flows are numbered in the order of the calls
/// of evolve(), which has to be the same in each run. Results of other steps (tagging, distances, edges) are not saved;
/// a resumed run computes them again.
///
/// Flow N is stored in flow-N.vdb (u, and the edge grid if the band has reached new voxels; meant for viewing) and
/// flow-N.state; both files are replaced together.
class COVOL_API Checkpoints {
public:
    /// @param folder  created if it does not exist
    /// @param every   seconds between two saved states of a flow; 0: a state is saved after each step
    /// @param job     identifies the run by version, options and digests of the inputs
    /// @param resume  whether the run resumes from states in the folder
    /// @throws Error Io; InvalidInput (the folder contains states of another job, or any states although `resume` is
    /// false).
    Checkpoints(const std::string& folder, double every, const std::string& job, bool resume);
    ~Checkpoints();
    Checkpoints(const Checkpoints&) = delete;
    Checkpoints& operator=(const Checkpoints&) = delete;

    /// Whether the folder contained states when this object was created.
    [[nodiscard]] bool had_states() const noexcept;
    /// Removes the files of this object, and the folder if it is then empty; to be called when the results have been
    /// saved.
    void remove() noexcept;

    // The following functions are for evolve() only.
    /// Begins the next flow and returns its number, counted from 1.
    [[nodiscard]] int begin_flow();
    /// The path of a file of a flow, for example "FOLDER/flow-03.vdb".
    [[nodiscard]] std::string file(int flow, const char* ending) const;
    /// Whether `every` seconds have passed since the last call of restart_clock() or begin_flow().
    [[nodiscard]] bool is_due() const;
    /// Begins a new interval, after which is_due() returns true; to be called after a state was written.
    void restart_clock();

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace covol
