#pragma once
#include <array>
#include <cstddef>
#include <vector>

// A second implementation of covol's scheme, Eqs. (13)-(17) and (19)-(22): naive, dense and in double precision. It has
// no code in common with covol, so that agreement of the two confirms the equations. Voxels are cells of edge h; an
// inactive voxel keeps its value; the domain's boundary is homogeneous Neumann, by a layer of ghost voxels that mirror
// the layer inside.
namespace covol::test {

/// Values at voxels 0 <= (i,j,k) < size, and one layer of ghosts around them.
class DenseField {
public:
    DenseField() = default;
    DenseField(int nx, int ny, int nz, double h, double fill = 0.0);

    [[nodiscard]] int nx() const { return nx_; }
    [[nodiscard]] int ny() const { return ny_; }
    [[nodiscard]] int nz() const { return nz_; }
    [[nodiscard]] double h() const { return h_; }
    /// Position in the padded array; i, j, k from -1 to the size.
    [[nodiscard]] std::size_t index(int i, int j, int k) const {
        return (static_cast<std::size_t>(i + 1) * (ny_ + 2) + (j + 1)) * (nz_ + 2) + (k + 1);
    }
    [[nodiscard]] double& at(int i, int j, int k) { return values_[index(i, j, k)]; }
    [[nodiscard]] double at(int i, int j, int k) const { return values_[index(i, j, k)]; }
    [[nodiscard]] double& operator[](std::size_t index) { return values_[index]; }
    [[nodiscard]] double operator[](std::size_t index) const { return values_[index]; }
    /// The size of the padded array.
    [[nodiscard]] std::size_t size() const { return values_.size(); }
    /// Sets each ghost to the value of the voxel that it mirrors.
    void mirror_ghosts();

private:
    int nx_ = 0, ny_ = 0, nz_ = 0;
    double h_ = 1.0;
    std::vector<double> values_;
};

/// The paper as printed, with one switch for each error that covol corrects. Tests set one of them to show which
/// identity it violates. The printed text is not quoted here; each switch is the form that its correction implies.
struct PrintedForm {
    bool bottom_velocity = false;  ///< the point term of v at the -z face has the sign of the other faces' formulas
    bool root = false;             ///< √(ε²+|∇u_T|) instead of √(ε²+|∇u_T|²)
    bool last_sum = false;         ///< W at the -z face sums l = 20...23 instead of 21...24
    bool neighbours = false;       ///< advection sums over all 26 voxels around p instead of the six of C_p
    bool gradient_norm = false;    ///< M takes the mean of |∇u_T|_ε, so that ε enters twice
};

/// Like covol::EvolveOptions, but explicit: no value has a symbolic meaning such as "one voxel".
struct DenseOptions {
    double theta = 0.0;
    double rho = 0.0;
    double delta = 0.0;
    double tau = 1.0;
    double epsilon = 1e-3;
    double edge_epsilon = 1e-3;     ///< slope of g per voxel
    double attraction_range = 0.0;  ///< 0: unlimited
    double image_yields = 0.0;
    /// A solve ends when no Gauss-Seidel correction exceeds this fraction of the first sweep's
    double solver_tolerance = 1e-10;
    int max_sweeps = 100000;
    PrintedForm printed;
};

/// The six faces of a voxel in the order of the coefficients: +x, -x, +y, -y, +z, -z.
inline constexpr std::array<std::array<int, 3>, 6> kFaces = {
    {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};

using Gradient = std::array<double, 3>;

/// The gradients on the 24 tetrahedra of voxel (i,j,k), four for each face in the order of kFaces. The tetrahedron of
/// a face's edge has the centres of p and q and the edge's ends as its corners; u is linear there, and its value at a
/// voxel's vertex is the mean of the eight voxels that meet in it.
/// @pre u's ghosts are mirrored.
[[nodiscard]] std::array<Gradient, 24> tetrahedron_gradients(const DenseField& u, int i, int j, int k);

/// 1 up to range/2, then a smooth step to 0 at range; 1 everywhere if range is 0.
[[nodiscard]] double attraction_taper(double distance, double range);
/// The integral of attraction_taper from 0 to distance.
[[nodiscard]] double attraction_potential(double distance, double range);

/// The fields of Eq. (3), each null if its weight in the equation is 0. A voxel at which a field is unknown has the
/// value NaN, and this field then exerts no pull across the voxel's faces.
struct DenseFields {
    const DenseField* distance = nullptr;
    const DenseField* edge = nullptr;
};

/// The linear system of one time step: for each active voxel p with the neighbours q,
/// u_p + Σ_q a_pq (u_q - u_p) = u_p of the step before.
struct DenseSystem {
    std::vector<std::ptrdiff_t> neighbour;  ///< offset of each q from p in a DenseField; six unless printed.neighbours
    std::vector<std::size_t> voxel;         ///< the active voxels, by their position in a DenseField
    std::vector<double> a;                  ///< neighbour.size() coefficients for each of `voxel`
    std::vector<double> right_side;         ///< for each of `voxel`
};

/// @param active  by position in a DenseField: nonzero if u may change there. Ghosts are never active.
[[nodiscard]] DenseSystem assemble(const DenseField& u, const std::vector<char>& active, const DenseFields& fields,
                                   const DenseOptions& options);

/// Successive over-relaxation in lexicographic order, with the factor chosen from options.tau and delta. Returns the
/// number of sweeps, or max_sweeps + 1 if that was not enough.
int solve(const DenseSystem& system, DenseField& u, const DenseOptions& options);

/// `steps` time steps; returns the mean number of sweeps in a step. @throws std::runtime_error if a solve does not
/// converge.
double dense_evolve(DenseField& u, const std::vector<char>& active, const DenseFields& fields,
                    const DenseOptions& options, int steps);

/// All voxels, but no ghosts.
[[nodiscard]] std::vector<char> all_active(const DenseField& u);

/// The implicit heat equation over `time`, in `steps` steps of backward Euler.
void dense_heat(DenseField& image, double time, int steps);

/// g = 1/(1 + K s²), Eq. (2), with K = edge_k and s the mean of |∇I| over the 24 tetrahedra of a voxel.
[[nodiscard]] DenseField dense_edge(const DenseField& image, double edge_k);

}  // namespace covol::test
