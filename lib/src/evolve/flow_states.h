#pragma once
#include <functional>
#include <string>

#include "covol/checkpoints.h"
#include "covol/fwd.h"
#include "evolve/state_file.h"

namespace covol::detail {

/// The saved states of one evolution, if the run has checkpoints.
class FlowStates {
public:
    using Exchange = std::function<void(StateFile& file)>;
    struct Grids {
        FloatGridPtr u, edge;  ///< null edge: it is still the one with which the evolution began
    };

    /// @param all  null: no states are kept
    explicit FlowStates(Checkpoints* all) : all_(all), number_(all != nullptr ? all->begin_flow() : 0) {}

    /// Whether there is a state to resume from.
    [[nodiscard]] bool any() const;
    /// @throws Error InvalidInput (damaged), Io.
    [[nodiscard]] Grids read_grids() const;
    void read(const Exchange& exchange) const;

    [[nodiscard]] bool are_enabled() const { return all_ != nullptr; }
    [[nodiscard]] bool is_due() const { return all_ != nullptr && all_->is_due(); }
    /// Replaces the previous state. @param u  null: the saved u and edge are kept. @throws Error Io.
    void write(const FloatGrid* u, const FloatGrid* edge, const Exchange& exchange);

private:
    Checkpoints* all_;
    int number_;
};

}  // namespace covol::detail
