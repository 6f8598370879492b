#pragma once
// The indicator function of a solid from points with normals on its border: the solution of the Poisson equation
// div grad chi = -div V for V = sum of area * normal at the points (Kazhdan, Bolitho and Hoppe, Poisson surface
// reconstruction, SGP 2006), which is the generalised winding number of the same points (Barill and others 2018).
// Solved on a stack of grids, each of which ends near the points that need it: the finest one there holds the
// equation, those below it its correction (full approximation storage; Brandt, Multi-level adaptive solutions to
// boundary-value problems, Math. Comp. 31, 1977); nodes beyond a grid's end are interpolated from the next coarser one.
#include <vector>

#include "cloud/poisson/grid_stack.h"
#include "covol/run.h"

namespace covol::cloud {

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
    /// From now on the indicator is drawn to 1/2 at the points; weight 1 on each node as strongly as its neighbours
    /// draw it to themselves.
    void screen(const std::vector<Vec3>& points, const std::vector<double>& weights);
    /// Takes another one's solution as the first guess.
    void start_from(const StackField& other);
    [[nodiscard]] const StackField& indicator() const { return solution_; }
    /// Of the solution.
    void multiply(double factor);

private:
    struct Level {
        std::vector<float> right, residual;
        std::vector<float> before;  ///< solution before it was corrected
        std::vector<float> ghosts;  ///< of each face beyond which no block is 8^2 nodes
        std::vector<float> screen;  ///< weights at the nodes, or empty
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
