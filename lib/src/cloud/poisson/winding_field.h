#pragma once
// The indicator function of a solid from points with normals on its border: the solution chi of the Poisson equation
// div grad chi = -div V, where V is the sum of area * normal at the points (Kazhdan, Bolitho and Hoppe, Poisson surface
// reconstruction, SGP 2006). chi is also the generalised winding number of these points (Barill et al., 2018). The
// equation is solved on a stack of grids; fine grids exist only near the points. At each position, the finest grid
// represents the equation and the coarser grids correct its solution (full approximation storage; Brandt, Multi-level
// adaptive solutions to boundary-value problems, Math. Comp. 31, 1977); nodes beyond a grid's end are interpolated from
// the next coarser one.
#include <vector>

#include "cloud/poisson/grid_stack.h"
#include "covol/run.h"

namespace covol::cloud {

/// Number of V-cycles for a solution without a close initial value. Half and twice as many changed no result of small
/// clouds and scans.
inline constexpr int kCyclesFromNothing = 8;

class WindingField {
public:
    explicit WindingField(std::shared_ptr<const GridStack> stack);

    /// Solves for the indicator, starting from the last solution.
    /// @param points   those of the stack
    /// @param vectors  area * outward unit normal, world units squared
    /// @param cycles   V-cycles of multigrid
    /// @throws Error Cancelled
    void solve(const std::vector<Vec3>& points, const std::vector<Vec3>& vectors, int cycles,
               const RunContext& run = {});
    /// Adds to all later solutions a penalty for deviations of the indicator from 1/2 at the points. A weight of 1 at a
    /// node is as strong as the node's coupling to one neighbour.
    void screen(const std::vector<Vec3>& points, const std::vector<double>& weights);
    /// Uses another field as the initial value.
    void start_from(const StackField& other);
    [[nodiscard]] const StackField& indicator() const { return solution_; }
    /// Multiplies the solution by `factor`.
    void multiply(double factor);

private:
    struct Level {
        std::vector<float> right, residual;
        std::vector<float> before;  ///< solution after restrict_from(); in correct(), its change since
        std::vector<float> ghosts;  ///< 8^2 values for each face without a block beyond it
        std::vector<float> screen;  ///< weights at the nodes by screen(), or empty
    };
    void cycle(std::size_t l);
    void sweep(std::size_t l);
    void find_residual(std::size_t l);
    void set_ghosts(std::size_t l);
    void restrict_from(std::size_t l);
    void correct(std::size_t l);
    void pad(std::size_t l, std::size_t block, float* padded) const;
    [[nodiscard]] const GridLevel& grid(std::size_t l) const { return solution_.stack().levels()[l]; }
    [[nodiscard]] const float* screen_of(std::size_t l, std::size_t block) const;

    StackField solution_;
    std::vector<Level> levels_;
};

}  // namespace covol::cloud
