#pragma once
#include <cstddef>
#include <vector>

#include "covol/clip.h"

namespace covol::guess {

/// can_enclose()
[[nodiscard]] bool span_space(const std::vector<Vec3>& marks);

/// Points on the ellipsoid around the marks whose axes follow the covariance of their positions; `times` is its size,
/// and with 1 it passes through the farthest mark. @pre span_space(marks)
[[nodiscard]] std::vector<Vec3> points_around(const std::vector<Vec3>& marks, double times);

/// Constraints on the function f of VariationalSurface. All lengths have the same unit, which may be any.
struct Constraints {
    std::vector<Vec3> marks;       ///< f is about 0 there, and its gradient has length 1
    std::vector<double> variance;  ///< of the position of each mark along its normal, length^2
    std::vector<Vec3> seeds;       ///< f is about `seed_value` there
    std::vector<double> seed_value;
    /// The region in which the body is known. Because the body may continue beyond it, the surface need not be closed
    /// there. Empty: everywhere.
    Clip world;
    /// Value and gradient, at the marks, of a function that is known beforehand. The constraints at the marks then
    /// apply to the sum of this function and f, while the energy and value() are those of f alone. Empty: no such
    /// function.
    std::vector<double> known_value;
    std::vector<Vec3> known_gradient;
    /// For each mark a line along which its normal probably lies, in either direction. The square of its length is the
    /// weight of this preference, as a multiple of the mean eigenvalue of the energy's matrix. Empty: no preference.
    std::vector<Vec3> axes;
};

/// The function f of VariationalSurface as a structure of arrays: nodes x, y, z; weights a of their values and b of
/// their gradients (0 at seeds); coefficients c of the polynomial.
struct Expansion {
    std::vector<double> x, y, z, a, bx, by, bz;
    double c[4] = {0, 0, 0, 0};
    /// Computes the values of f at from + n * step for n < count.
    void row(const double* from, const double* step, int count, double* values) const;
    void negate();
};

using Normals = std::vector<Vec3>;  ///< one for each mark

/// Initial values of the search for the gradients of minimum energy.
enum class Search {
    Near,  ///< the given normals only
    Wide,  ///< also other directions, see the parameter `search` of VariationalSurface()
};

/// The function of minimum bending energy whose zero level set passes the marks: variational implicit surfaces from
/// points without normals (Huang, Carr, Ju, "Variational implicit point set surfaces", ACM Trans. Graph. 38(4), 2019).
///
///   f(x) = sum_j a_j phi(x - x_j) - sum_j b_j . grad phi(x - x_j) + c0 + c . x,   phi(r) = |r|^3
///
/// interpolates values s_j and unit gradients g_j at the marks x_j with the minimum third-order energy y^T M^-1 y,
/// where y = (s, g) and M contains phi and its derivatives between the marks (triharmonic Hermite interpolation). The
/// g_j are those unit vectors for which that energy is minimum. The values s_j minimise energy + sum_j s_j^2 /
/// lambda_j, which adds lambda_j to the diagonal of the values' block of M: they are 0 if the marks are exact. lambda_j
/// is the variance of the mark divided by the variance of f itself, for which the maximum-likelihood estimate given the
/// marks is used: the energy divided by its degrees of freedom.
class VariationalSurface {
public:
    /// @param normals  initial directions of the gradients, or empty
    /// @param search   whether other initial values are tried as well (away from the centroid of the marks, away from
    ///                  the neighbours): of the closed results the one of minimum energy is used
    /// @param amplitude  scale of the covariance of f, which is amplitude * |x|^3; unit 1 / length; 0: estimated from
    /// the marks
    /// @throws Error InvalidInput (fewer than four distinct marks, or all in one plane); Numerical.
    VariationalSurface(const Constraints& constraints, const Normals& normals, Search search, double amplitude = 0);

    /// The value of f: close to the marks approximately the signed distance to the surface; negative inside, on the
    /// bounded side.
    [[nodiscard]] double value(const Vec3& at) const;
    [[nodiscard]] Vec3 gradient(const Vec3& at) const;
    /// value() at from + n * step, n < count.
    void row(const Vec3& from, const Vec3& step, int count, double* values) const;

    /// Log likelihood of the marks, given their variance and the amplitude, up to a constant; computed only if the
    /// amplitude is estimated.
    [[nodiscard]] double log_likelihood() const { return log_likelihood_; }
    [[nodiscard]] double amplitude() const { return amplitude_; }

private:
    Vec3 center_{0, 0, 0};
    double radius_ = 1;
    double amplitude_ = 0, log_likelihood_ = 0;
    Expansion f_;  // for positions (x - center_) / radius_, so that the marks lie in the unit ball
};

}  // namespace covol::guess
