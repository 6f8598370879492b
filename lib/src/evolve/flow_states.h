#pragma once
#include <functional>
#include <string>

#include "covol/checkpoints.h"
#include "covol/fwd.h"
#include "evolve/state_file.h"

namespace covol::detail {

/// The states of one flow, where the run has checkpoints.
class FlowStates {
public:
    using Exchange = std::function<void(StateFile& file)>;
    struct Grids {
        FloatGridPtr u, edge;  ///< no edge: that which the flow began with
    };

    /// @param all  null: none are kept
    explicit FlowStates(Checkpoints* all) : all_(all), number_(all != nullptr ? all->begin_flow() : 0) {}

    /// Whether there is one to go on from.
    [[nodiscard]] bool any() const;
    /// @throws Error InvalidInput (damaged), Io.
    [[nodiscard]] Grids read_grids() const;
    void read(const Exchange& exchange) const;

    [[nodiscard]] bool are_kept() const { return all_ != nullptr; }
    [[nodiscard]] bool is_due() const { return all_ != nullptr && all_->is_due(); }
    /// Puts a state in place of the one before. @param u  null: as before, like the edge. @throws Error Io.
    void write(const FloatGrid* u, const FloatGrid* edge, const Exchange& exchange);

private:
    Checkpoints* all_;
    int number_;
};

}  // namespace covol::detail
