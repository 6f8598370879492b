#pragma once
#include <vector>

// The co-volume scheme on one leaf of 8^3 voxels: plain functions on arrays, no OpenVDB types.
//
// Units: u and d are in voxels, tau in h, delta in h, so that h does not appear. A padded buffer holds a leaf and one
// layer around it: 10 x 10 rows of 16 floats, the row's voxels -1..8 at 3..12, so that no load of 8 crosses a cache
// line.
//
// scheme_kernels.cpp is compiled once for each instruction set; kernels() selects one at run time.
namespace covol::detail {

inline constexpr int kRow = 16;
inline constexpr int kPaddedSize = 10 * 10 * kRow;
/// Index of voxel (i,j,k), each -1..8.
inline constexpr int padded(int i, int j, int k) { return ((i + 1) * 10 + (j + 1)) * kRow + k + 4; }

/// Neighbours q of a voxel in the order of the coefficient arrays.
enum Face { kMinusI, kPlusI, kMinusJ, kPlusJ, kMinusK, kPlusK };

/// Marks an unknown value of the points' potential phi or of the edge detector g. There is no attraction across a face
/// beside a voxel with an unknown value.
inline constexpr float kUnknown = -1.0F;

/// A coefficient of a row, 0 to 1, in units of 1/kFractionUnit: half the memory of a float, because sweeps are limited
/// by memory access.
using Fraction = unsigned short;
inline constexpr int kFractionUnit = 65535;
/// Index in a leaf's rows of the fraction of face f of voxel n: eight voxels along k side by side, face after face, so
/// that a sweep reads one stream.
inline constexpr int fraction_at(int f, int n) { return (n >> 3) * 48 + f * 8 + (n & 7); }

/// A leaf's own 512 values and those of the leaves across its faces, by Face.
struct LeafStar {
    float* inner;
    const float* across[6];
};

/// Bit 8i+j: the row (i,j) of eight voxels.
using RowMask = unsigned long long;

struct NextRows {
    const float* b = nullptr;
    const Fraction* c = nullptr;
};

struct SchemeConstants {
    float tau;            ///< τ/h
    float theta;          ///< θ
    float rho;            ///< ρ
    float curvature;      ///< τδ/h²
    float epsilon2;       ///< ε² in √(ε² + |∇u|²)
    float edge_epsilon2;  ///< ε² in √(ε² + |∇g|²), with |∇g| per voxel
};

/// Properties of the equations (matrix rows) of a leaf.
struct RowFacts {
    float largest;    ///< maximum of Σ_q |a_pq| over active rows
    double residual;  ///< Σ (Gauss-Seidel value - u)² over active voxels at u = u^{n-1}
};

struct SchemeKernels {
    const char* name;  ///< "avx2", ...

    /// Coefficients from u^{n-1}: Eqs. (13)-(17), (19)-(22) of the paper (see docs/method.md), divided by the row's
    /// diagonal, c[q] = -a_pq / a_pp >= 0, so that a row is u_p = b_p + Σ_q c[q] (u_q - b_p), b = u^{n-1}. Each c is
    /// accurate to half of 1/kFractionUnit, and their sum is less than 1.
    /// @param u      padded, with edges and corners
    /// @param phi    padded (faces), potential of the points' attraction; null if there is none
    /// @param g      padded (faces), edge detector; null if there is none
    /// @param rho    512 factors on ρ; null means 1
    /// @param active 512 bits; other voxels get c = 0 (u_p = b_p); rows of eight without an active voxel are not
    ///     written
    /// @param c      6 x 512, see fraction_at()
    RowFacts (*assemble)(const float* u, const float* phi, const float* g, const float* rho,
                         const unsigned long long* active, const SchemeConstants& constants, Fraction* c);

    /// `inner` SOR sweeps in four colours in place over a leaf's rows of eight with an active voxel.
    /// @param next  b and c of the next leaf, to be prefetched meanwhile
    /// @return Σ (Gauss-Seidel value - u)² during the first sweep
    double (*relax)(const LeafStar& u, const float* b, const Fraction* c, const unsigned long long* active, float omega,
                    int inner, const NextRows& next);

    /// out = fraction * image + weight * Σ_q u_q - out on every voxel, the sum over the six neighbours: a step of
    /// Clenshaw's recurrence in the mean of the neighbours.
    void (*mean_step)(const LeafStar& u, const float* image, float fraction, float weight, float* out);

    /// Mean over the 24 tetrahedra of |∇u|, per voxel; 512 values. @param u padded, with edges and corners
    void (*mean_gradient)(const float* u, float* out);

    /// Godunov's upwind scheme for |∇d| = 1 in a leaf, in voxels: Gauss-Seidel in four orders of the rows until no
    /// value decreases by more than `tolerance` (R. Zhao 2005, with a surface that cuts voxel edges as boundary).
    /// @param d    padded (faces), >= 0; values only decrease; the halo is not written
    /// @param cut  from cut_edges
    /// @param due  the rows to be visited, which are next to a decrease. Rows next to a row that decreases are added
    /// @return     the rows with a value that decreased by more than `tolerance`
    RowMask (*eikonal)(float* d, const float* cut, RowMask due, float tolerance);

    /// @param u    padded (faces)
    /// @param cut  out, 3 x 512, by axis: 1/s if the zero level set cuts an edge of the voxel along it, at the distance
    ///     s in (0,1]; else 0
    void (*cut_edges)(const float* u, float* cut);

    /// |u|, replaced by d if no edge of the voxel is cut, else scaled by one factor for the voxel and those across its
    /// cut edges, so that the zero level set hardly moves (D. Hartmann, M. Meinke, W. Schroeder 2010, scheme CR-1).
    /// @param u    padded (faces), as d
    /// @param out  512
    void (*settle)(const float* u, const float* d, float* out);
};

/// Homogeneous Neumann condition in a padded buffer: voxels outside lo..hi (local, inclusive; beyond -1..8 if the
/// boundary is elsewhere) take the value of the nearest voxel inside.
void mirror_outside(float* padded_values, const int lo[3], const int hi[3]);

/// Removes the faces on the boundary lo..hi from the rows: their coefficients become 0, and the others of the same row
/// are scaled accordingly. All coefficients of voxels outside of the boundary become 0.
void close_faces(Fraction* c, const int lo[3], const int hi[3]);

/// The fastest kernels that this processor supports; COVOL_SIMD=baseline|avx2|avx512 in the environment selects others.
const SchemeKernels& kernels();

/// All kernels that this processor supports, the slowest first.
std::vector<const SchemeKernels*> available_kernels();

}  // namespace covol::detail
