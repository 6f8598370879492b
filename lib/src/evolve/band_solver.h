#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "base/large_allocator.h"
#include "covol/domain.h"
#include "covol/evolve.h"
#include "evolve/motion.h"
#include "grid/halo.h"
#include "grid/leaf_band.h"
#include "scheme/scheme.h"

namespace covol::detail {

/// The linear system of one band: u_p + Σ_q a_pq (u_q - u_p) = u_p^{n-1}, a_pq = (τ/h³) min(v_pq, 0) - (τδ/h²) M_p W_pq
/// <= 0, Eqs. (13)-(17), (19)-(22); docs/method.md defines v_pq, M_p and W_pq. One step assembles the rows of every
/// leaf from u^{n-1}, then visits the leaves in two colours, starting from 2 u^{n-1} - u^{n-2}, until the residual is
/// `solver_tolerance` times that of u^{n-1}. Values are in voxels, not world units.
///
/// Work is done on active leaves only: a leaf becomes inactive once neither it nor any of the 26 around it has moved by
/// more than a threshold, and active again once one of those has. Within a solve, a leaf is not visited again if it and
/// its neighbours across the faces have converged.
class BandSolver {
public:
    struct Counts {
        std::int64_t passes = 0;        ///< number of passes over the leaves
        std::int64_t visits = 0;        ///< number of visits of a leaf
        std::int64_t visits_saved = 0;  ///< visits omitted: the leaf was inactive or had converged
        double seconds_assembly = 0, seconds_sweeps = 0;
    };

    /// Copies u, the fields whose weight is not 0, and the given bounds into leaf arrays.
    /// @throws Error InvalidInput (no active voxel; a value that is not finite).
    BandSolver(const FloatGrid& u, const EvolveFields& fields, const EvolveOptions& options, const Domain& domain);

    /// What a solver passes on to the solver of the next band, see keep_inactive(): the band's leaves, which of them
    /// are active, and how far the surface has moved in each.
    struct LeafStates {
        LeafBand band;
        std::vector<unsigned char> active;
        std::vector<float> pending_motion;  ///< motion since the leaf last activated its neighbours, voxels
        std::vector<LeafMotion> motions;
    };
    /// Moves the states out of the solver, which cannot be used afterwards.
    [[nodiscard]] LeafStates take_leaf_states();
    /// Takes over the states of leaves from the previous band, so that inactive leaves stay inactive. Leaves that are
    /// new, or whose values have changed, are active.
    /// @param changed  sorted origins of the leaves whose values differ from those of the previous band
    void keep_inactive(const LeafStates& old, const std::vector<Coord>& changed);

    /// Writes or reads everything that steps have changed. When it is read, the band has to be that of the solver that
    /// wrote it.
    void exchange(StateFile& file);

    /// One time step of length τ = tau * h on the active leaves.
    Motion step(double tau, Counts& counts);
    /// Decides which leaves are active from now on: those that have moved, and the 26 around each.
    /// @param motion     of each leaf since the last call, voxels; accumulates over calls until it reaches the
    ///     threshold
    /// @param threshold  voxels
    void update_active_leaves(const std::vector<float>& motion, double threshold);
    /// The maximum of |u^n - u^{n-1}| in each leaf in the last step, voxels.
    [[nodiscard]] std::vector<float> largest_changes() const;
    [[nodiscard]] bool is_leaf_active(std::size_t leaf) const { return leaf_active_[leaf] != 0; }
    /// Redistances u on the active leaves, clamped to `clamp` voxels; see LocalDistance.
    void redistance(double clamp);
    /// Undoes the last step.
    void restore_previous();
    /// Writes the values of active voxels to the grid from which this solver was made; inactive voxels remain
    /// unchanged.
    void store(FloatGrid& u) const;

    [[nodiscard]] const LeafBand& band() const noexcept { return band_; }
    [[nodiscard]] BandValues values() const { return {field_.values, band_, domain_}; }
    [[nodiscard]] std::int64_t active_count() const noexcept { return active_count_; }

private:
    void gather_fields(const EvolveFields& fields);
    void hold_to_bounds();
    struct Rows {
        double largest;   ///< maximum of Σ_q |a_pq|
        double residual;  ///< root mean square at u^{n-1}, voxels
    };
    Rows assemble(const SchemeConstants& constants);
    void solve(double omega, double first, Counts& counts);
    double sweep(float omega, double goal, Counts& counts);
    [[nodiscard]] double root_mean_square() const;  ///< of the residuals, over the band, voxels
    [[nodiscard]] bool is_unconverged(std::size_t leaf, double goal) const;
    Motion measure();

    [[nodiscard]] const unsigned long long* active(std::size_t leaf) const {
        return reinterpret_cast<const unsigned long long*>(band_.active(leaf).data());
    }
    [[nodiscard]] Fraction* rows(std::size_t leaf) {
        return reinterpret_cast<Fraction*>(rows_.data() + leaf * kRowBytes);
    }

    const EvolveOptions& options_;
    const Domain domain_;
    LeafBand band_;
    std::int64_t active_count_ = 0;
    HaloField field_;  // u
    std::optional<HaloField> phi_, edge_, image_weight_, obstacle_, floor_;
    LeafArray<float> previous_;  // u^{n-1}; scratch for redistance()
    bool has_previous_ = false;  // previous_ is u^{n-1}, and not scratch
    static constexpr std::size_t kRowBytes = 6 * kLeafSize * sizeof(Fraction);
    std::vector<std::byte, LargeAllocator<std::byte>> rows_;  // coefficients of each leaf; scratch between steps
    // One for each leaf:
    std::vector<int> active_counts_;
    std::vector<unsigned char> leaf_active_;
    std::vector<float> pending_motion_;
    std::vector<LeafMotion> motions_;
    std::vector<double> residuals_;  // sum of squared residuals at the last visit
};

}  // namespace covol::detail
