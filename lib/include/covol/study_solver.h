#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "covol/api.h"
#include "covol/pipeline.h"
#include "covol/study.h"

namespace covol {

/// What is known of a structure's surface.
struct StudyResult {
    enum class Stage {
        Empty,    ///< there is no surface yet: `message` says what is missing
        Working,  ///< `progress` of the next one
        First,  ///< the last surface, moved to the marks; without one, the surface through the marks alone; of a large
                ///< structure in voxels of twice the size
        Refined,  ///< as `covol segment` gives it
        Failed    ///< `message` says why; the last surface stays as it is
    };
    StudyId structure = 0;
    Stage stage = Stage::Empty;
    std::uint64_t version = 0;   ///< of the surface, grows; 0: there is none
    std::uint64_t sequence = 0;  ///< what the caller gave with the marks
    double progress = 0;         ///< in [0,1]
    std::string message;
    std::shared_ptr<const SegmentResult> surface;  ///< of First and Refined
    double seconds = 0;                            ///< that it took
};

/// Finds the surfaces of structures whose marks change, one at a time, on a thread of its own: the structure that
/// changed last comes first, and what its change made obsolete is cancelled. It computes at a lower priority than the
/// threads of its caller.
///
/// Each structure is solved for itself, as segment_structures() solves a single one; where structures overlap is
/// decided by who asks for all of them together.
class StudySolver {
public:
    /// @param image  gives the one that a surface is made from, on the solver's thread
    /// @param read_guess  as of StudySite; none: structures with a guess fail
    /// @param told  called from the solver's thread, one result at a time; it must not call the solver
    COVOL_API StudySolver(std::function<Image()> image, SegmentOptions options,
                          std::function<void(const StudyResult&)> on_result, const RunContext& run = {},
                          std::function<GivenGuess(const StudyGuess&, const RunContext&)> read_guess = {});
    /// Cancels what runs.
    COVOL_API ~StudySolver();
    StudySolver(const StudySolver&) = delete;
    StudySolver& operator=(const StudySolver&) = delete;

    /// From the next solve() on. What runs is not affected: all structures are to be solved again.
    COVOL_API void set_options(SegmentOptions options);
    /// The structure's marks are these now.
    COVOL_API void solve(std::shared_ptr<const StudyStructure> structure, std::uint64_t sequence);
    /// The same, of a structure whose surface is known: when nothing else is left to do, and without a first one.
    COVOL_API void confirm(std::shared_ptr<const StudyStructure> structure, std::uint64_t sequence);
    /// It is gone.
    COVOL_API void forget(StudyId structure);
    /// The newest surface; null: there is none.
    [[nodiscard]] COVOL_API std::shared_ptr<const SegmentResult> surface(StudyId structure) const;
    /// Until nothing is left to do.
    COVOL_API void wait() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace covol
