#pragma once
// Weighted sums over points for the fit of a quadric, computed for four points at a time.
#include <cstddef>
#include <vector>

namespace covol::cloud {

inline constexpr std::size_t kFitLanes = 4;

/// A cloud as one array for each coordinate, for vector instructions.
class FitCloud {
public:
    void reserve(std::size_t count);
    void add(const double (&place)[3], const double (&normal)[3], double count);
    /// Must be called after the last add(): appends padding, so that kFitLanes values may be read from any point on.
    void finish();

    std::vector<double> place[3], normal[3], count;
};

/// The neighbourhood to which a quadric is fitted.
struct FitFrame {
    double origin[3], axes[3][3];  ///< u, v and the normal
    double radius;
};

/// Points in a frame in which the neighbourhood is the unit ball, padded with points of count 0 to a multiple of
/// kFitLanes.
struct FitPoints {
    std::vector<double> u, v, t, count;
    std::size_t size = 0;  ///< without the padding; the arrays may be longer

    /// Reserves memory for `room` points; all points are lost.
    void clear(std::size_t room);
    void fill_up();
};

/// Appends to `near` those of the cloud's points begin..end-1 that lie within frame.radius of its origin and whose
/// normals point to the same side as the frame's normal.
/// @pre clear() has reserved memory for all of them
void select_near(const FitCloud& cloud, std::size_t begin, std::size_t end, const FitFrame& frame, FitPoints& near);

/// Sums over the points. Each is weighted by count * near, where near = (1 - u^2 - v^2 - t^2)^2.
struct FitSums {
    double moments[15] = {};            ///< of u^a v^b: 1 | u v | uu uv vv | uuu uuv uvv vvv | uuuu uuuv uuvv uvvv vvvv
    double heights[6] = {};             ///< of t times 1 u v uu uv vv
    double squares = 0;                 ///< of count * near^2
    double near = 0, near_squares = 0;  ///< of near and of near^2, without the counts
};
[[nodiscard]] FitSums fit_sums(const FitPoints& points);

/// Residual of t - height, where height = x0 + x1 u + x2 v + x3 uu + x4 uv + x5 vv. Here near is (1 - u^2 - v^2)^2,
/// without t: otherwise, points far from the quadric would have small weights, and noise that is hardly smaller than
/// the neighbourhood would be underestimated.
struct FitResidual {
    double squares = 0;  ///< sum of count * near * (t - height)^2
    double weight = 0;   ///< sum of count * near
    double near = 0;     ///< sum of near
};
[[nodiscard]] FitResidual fit_residual(const FitPoints& points, const double x[6]);

}  // namespace covol::cloud
