#pragma once
// The indicator function of a solid from points with normals on its border: the solution of the Poisson equation
// div grad chi = -div V for V = sum of area * normal at the points (Kazhdan, Bolitho and Hoppe, Poisson surface
// reconstruction, SGP 2006), which is the generalised winding number of the same points (Barill and others 2018).
#include <array>
#include <vector>

#include "covol/domain.h"
#include "covol/run.h"

namespace covol::cloud {

/// A regular lattice of nodes, dense: it is coarse. chi is 0 on its boundary.
struct Lattice {
    Vec3 origin{0, 0, 0};        ///< of node (0,0,0), world
    double cell = 1;             ///< distance of nodes, world units
    std::array<int, 3> nodes{};  ///< along each axis; one less is a multiple of 16
    [[nodiscard]] std::size_t size() const {
        return std::size_t(nodes[0]) * std::size_t(nodes[1]) * std::size_t(nodes[2]);
    }
};

/// Around the box, wider by a share of its longest side on every side; about `cells` along the longest of its own.
[[nodiscard]] Lattice lattice_around(const WorldBox& box, double share, int cells);

/// Values at the nodes, the coefficients of cubic B-splines; beyond the lattice as at its end.
struct LatticeField {
    explicit LatticeField(const Lattice& l) : lattice(l), values(l.size()) {}
    Lattice lattice;
    std::vector<float> values;  ///< k fastest

    struct Sample {
        double value;
        Vec3 gradient;
    };  ///< gradient in 1 / world unit
    [[nodiscard]] Sample at(const Vec3& world) const;
    [[nodiscard]] double value_at(const Vec3& world) const;
};

/// Sums of the points' values, spread over the nodes around them.
[[nodiscard]] LatticeField spread(const Lattice& lattice, const std::vector<Vec3>& points,
                                  const std::vector<double>& values);

/// The number of points in a cell's volume, smoothed by passes of (1 2 1) / 4 along each axis.
[[nodiscard]] LatticeField point_density(const Lattice& lattice, const std::vector<Vec3>& points, int passes);

class WindingField {
public:
    explicit WindingField(const Lattice& lattice);

    /// Solves for the indicator, starting from the last solution.
    /// @param vectors  area * outward unit normal, world units squared
    /// @param cycles   V-cycles of multigrid
    /// @throws Error Cancelled
    void solve(const std::vector<Vec3>& points, const std::vector<Vec3>& vectors, int cycles,
               const RunContext& run = {});
    /// From now on the indicator is drawn to 1/2 at the points; weight 1 on each node as strongly as its neighbours
    /// draw it to themselves.
    void screen(const std::vector<Vec3>& points, const std::vector<double>& weights);
    /// Takes another one's solution as the first guess.
    void start_from(const LatticeField& other);
    [[nodiscard]] const LatticeField& indicator() const { return levels_.front().solution; }
    /// Of the solution.
    void multiply(double factor);

private:
    struct Level {
        LatticeField solution;
        std::vector<float> right, residual;
        std::vector<float> screen;  ///< weights at the nodes, or empty
    };
    void cycle(std::size_t level);
    std::vector<Level> levels_;
};

}  // namespace covol::cloud
