#pragma once
#include <cstddef>
#include <vector>

#include "covol/clip.h"

namespace covol::guess {

/// Whether marks can have a body between them: at least four, not all in one plane.
[[nodiscard]] bool span_space(const std::vector<Vec3>& marks);

/// Points on an ellipsoid around the marks, times its size. @pre span_space(marks)
[[nodiscard]] std::vector<Vec3> points_around(const std::vector<Vec3>& marks, double times);

/// What a surface through marks has to meet. Lengths in one unit, any.
struct Constraints {
    std::vector<Vec3> marks;       ///< f is about 0 there, and its gradient has length 1
    std::vector<double> variance;  ///< of each mark's place along the normal, length^2; the same count
    std::vector<Vec3> seeds;       ///< f is about `seed_value` there
    std::vector<double> seed_value;
    /// Beyond its end nothing is known of the body, it may go on. Empty: the world has no end.
    Clip world;
    /// What is known of f beforehand at the marks, its value and its gradient: the energy is that of what f adds to it,
    /// and value() leaves it out. Empty: nothing.
    std::vector<double> known_value;
    std::vector<Vec3> known_gradient;
    /// Of each mark a line along which its normal likely lies, either way; the square of its length says how much that
    /// counts, in mean eigenvalues of the energy. Empty: nothing is known.
    std::vector<Vec3> axes;
};

/// f of VariationalSurface, as arrays: node, weight of its value and of its gradient (0 for seeds).
struct Expansion {
    std::vector<double> x, y, z, a, bx, by, bz;
    double c[4] = {0, 0, 0, 0};
    /// At from + n * step, n < count.
    void row(const double* from, const double* step, int count, double* values) const;
    void negate();
};

using Normals = std::vector<Vec3>;  ///< of each mark

/// Where the gradients of least energy are looked for.
enum class Search {
    Near,  ///< beside the first guess
    Wide,  ///< beside others, too
};

/// The function whose zero level set passes the marks and bends least: variational implicit surfaces from points
/// without normals (Huang, Carr, Ju, "Variational implicit point set surfaces", ACM Trans. Graph. 38(4), 2019).
///
///   f(x) = sum_j a_j phi(x - x_j) - sum_j b_j . grad phi(x - x_j) + c0 + c . x,   phi(r) = |r|^3
///
/// interpolates values s_j and unit gradients g_j at the marks with the least third-order energy y^T M^-1 y, y = (s, g)
/// (triharmonic Hermite interpolation); the g_j are those unit vectors for which that least energy is least, and the
/// values trade energy for closeness: minimise energy + sum_j s_j^2 / lambda_j, which adds lambda_j to the diagonal of
/// the values' block of M. lambda_j is the mark's variance over the variance of f itself, which is its likeliest
/// value given the marks: energy over its degrees of freedom.
class VariationalSurface {
public:
    /// @param normals  a first guess of the gradients' directions, or empty
    /// @param search   whether others are tried as well (the flattest modes of the energy, away from the centroid, away
    ///                 from neighbours): of the ends that close, the one of least energy is kept
    /// @param amplitude  variance of f per length: f is as likely as amplitude * |x|^3 is its covariance; 0: from the
    /// marks
    /// @throws Error InvalidInput (fewer than four distinct marks, or all in one plane); Numerical.
    VariationalSurface(const Constraints& constraints, const Normals& normals, Search search, double amplitude = 0);

    /// About a distance beside the marks; negative inside (the side that does not reach to infinity).
    [[nodiscard]] double value(const Vec3& at) const;
    [[nodiscard]] Vec3 gradient(const Vec3& at) const;
    /// value() at from + n * step, n < count.
    void row(const Vec3& from, const Vec3& step, int count, double* values) const;

    /// Of the marks, given their variance and the amplitude, but for a constant.
    [[nodiscard]] double log_likelihood() const { return log_likelihood_; }
    [[nodiscard]] double amplitude() const { return amplitude_; }

private:
    Vec3 center_{0, 0, 0};
    double radius_ = 1;
    double amplitude_ = 0, log_likelihood_ = 0;
    Expansion f_;  // in the unit ball
};

}  // namespace covol::guess
