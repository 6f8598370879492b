#pragma once
#include <cstddef>
#include <vector>

#include "covol/clip.h"

namespace covol::guess {

/// Whether marks can enclose a body: at least four, not all in one plane.
[[nodiscard]] bool span_space(const std::vector<Vec3>& marks);

/// Points on an ellipsoid around the marks, scaled by `times`. @pre span_space(marks)
[[nodiscard]] std::vector<Vec3> points_around(const std::vector<Vec3>& marks, double times);

/// Constraints of a surface through marks. Lengths in any one unit.
struct Constraints {
    std::vector<Vec3> marks;       ///< f is about 0 there, and its gradient has length 1
    std::vector<double> variance;  ///< of each mark's position along the normal, length^2; the same count
    std::vector<Vec3> seeds;       ///< f is about `seed_value` there
    std::vector<double> seed_value;
    /// Beyond its end nothing is known of the body, which may continue there. Empty: the world has no end.
    Clip world;
    /// Value and gradient, at the marks, of a function that is known beforehand. The constraints at the marks then
    /// apply to the sum of this function and f, while the energy and value() are those of f alone. Empty: no such
    /// function.
    std::vector<double> known_value;
    std::vector<Vec3> known_gradient;
    /// For each mark a line along which its normal probably lies, in either direction; the square of its length is the
    /// weight, in mean eigenvalues of the energy. Empty: nothing is known.
    std::vector<Vec3> axes;
};

/// f of VariationalSurface, as a structure of arrays: nodes, weights of their values and gradients (0 for seeds).
struct Expansion {
    std::vector<double> x, y, z, a, bx, by, bz;
    double c[4] = {0, 0, 0, 0};
    /// At from + n * step, n < count.
    void row(const double* from, const double* step, int count, double* values) const;
    void negate();
};

using Normals = std::vector<Vec3>;  ///< of each mark

/// Initial values from which the gradients of minimum energy are searched.
enum class Search {
    Near,  ///< the given initial value only
    Wide,  ///< also others
};

/// The function of minimum bending energy whose zero level set passes the marks: variational implicit surfaces from
/// points without normals (Huang, Carr, Ju, "Variational implicit point set surfaces", ACM Trans. Graph. 38(4), 2019).
///
///   f(x) = sum_j a_j phi(x - x_j) - sum_j b_j . grad phi(x - x_j) + c0 + c . x,   phi(r) = |r|^3
///
/// interpolates values s_j and unit gradients g_j at the marks with the minimum third-order energy y^T M^-1 y, y = (s,
/// g) (triharmonic Hermite interpolation); the g_j are those unit vectors for which that energy is minimum, and the
/// values balance energy against distance to the marks: minimise energy + sum_j s_j^2 / lambda_j, which adds lambda_j
/// to the diagonal of the values' block of M. lambda_j is the mark's variance over the variance of f itself, for which
/// the maximum-likelihood estimate given the marks is used: energy over its degrees of freedom.
class VariationalSurface {
public:
    /// @param normals  initial directions of the gradients, or empty
    /// @param search   whether other initial values are tried as well (away from the centroid of the marks, away from
    ///                  the neighbours): of the closed results the one of minimum energy is used
    /// @param amplitude  variance of f per length: the covariance of f is amplitude * |x|^3; 0: estimated from the
    /// marks
    /// @throws Error InvalidInput (fewer than four distinct marks, or all in one plane); Numerical.
    VariationalSurface(const Constraints& constraints, const Normals& normals, Search search, double amplitude = 0);

    /// Close to the marks about a distance; negative inside (the bounded side).
    [[nodiscard]] double value(const Vec3& at) const;
    [[nodiscard]] Vec3 gradient(const Vec3& at) const;
    /// value() at from + n * step, n < count.
    void row(const Vec3& from, const Vec3& step, int count, double* values) const;

    /// Log likelihood of the marks, given their variance and the amplitude, up to a constant.
    [[nodiscard]] double log_likelihood() const { return log_likelihood_; }
    [[nodiscard]] double amplitude() const { return amplitude_; }

private:
    Vec3 center_{0, 0, 0};
    double radius_ = 1;
    double amplitude_ = 0, log_likelihood_ = 0;
    Expansion f_;  // in the unit ball
};

}  // namespace covol::guess
