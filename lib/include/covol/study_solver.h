#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "covol/api.h"
#include "covol/pipeline.h"
#include "covol/study.h"

namespace covol {

/// The state of the computation of a structure's surface.
struct StudyResult {
    enum class Stage {
        Empty,    ///< there is no surface yet: `message` states what is missing
        Working,  ///< the next surface is being computed, see `progress`
        /// A preliminary surface, computed without the image: the previous surface, corrected by the marks, or, if
        /// there is none, the surface through the marks. It is computed with twice the voxel size for large structures.
        First,
        Refined,  ///< the final surface, as from `covol segment`
        Failed    ///< `message` states why; the previous surface remains valid
    };
    StudyId structure = 0;
    Stage stage = Stage::Empty;
    std::uint64_t version = 0;   ///< number of the surface, increasing; 0: there is no surface
    std::uint64_t sequence = 0;  ///< number that the caller gave with the marks
    double progress = 0;         ///< in [0,1]
    std::string message;
    std::shared_ptr<const SegmentResult> surface;  ///< for First and Refined
    double seconds = 0;                            ///< duration of the computation
};

/// Computes the surfaces of structures whose marks change, one at a time, on a separate thread: the structure that
/// changed last comes first, and a running computation is cancelled and repeated later if it is still needed. The
/// thread has a lower priority than those of the caller.
///
/// Each structure is solved independently, as segment_structures() solves a single one; overlaps between structures are
/// resolved by the caller that requests all of them together.
class StudySolver {
public:
    /// @param image  returns the image; called in the constructor and on the solver's thread
    /// @param read_guess  as in StudySite; if it is empty, structures with a guess fail
    /// @param on_result  called on the solver's thread, one result at a time; it must not call the solver
    COVOL_API StudySolver(std::function<Image()> image, SegmentOptions options,
                          std::function<void(const StudyResult&)> on_result, const RunContext& run = {},
                          std::function<GivenGuess(const StudyGuess&, const RunContext&)> read_guess = {});
    /// Cancels the running computation.
    COVOL_API ~StudySolver();
    StudySolver(const StudySolver&) = delete;
    StudySolver& operator=(const StudySolver&) = delete;

    /// Sets the options of computations that begin afterwards. Surfaces that were computed before are not updated;
    /// solve() has to be called again for their structures.
    COVOL_API void set_options(SegmentOptions options);
    /// Computes the surface of a structure; to be called when its marks have changed.
    COVOL_API void solve(std::shared_ptr<const StudyStructure> structure, std::uint64_t sequence);
    /// Computes the surface of a structure if the caller already has a surface for the current marks. The computation
    /// begins after those of all waiting structures, and omits the stage First.
    COVOL_API void confirm(std::shared_ptr<const StudyStructure> structure, std::uint64_t sequence);
    /// Discards a structure and its surface; to be called when the structure was removed.
    COVOL_API void forget(StudyId structure);
    /// The newest surface; null if there is none.
    [[nodiscard]] COVOL_API std::shared_ptr<const SegmentResult> surface(StudyId structure) const;
    /// Waits until all computations are finished.
    COVOL_API void wait() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace covol
