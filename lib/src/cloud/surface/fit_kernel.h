#pragma once
// Weighted sums over points for the fit of a quadric, four at a time.
#include <cstddef>
#include <vector>

namespace covol::cloud {

inline constexpr std::size_t kFitLanes = 4;

/// Points in a frame in which the neighbourhood is the unit ball, in arrays whose size is a multiple of kFitLanes,
/// filled up with points of no count.
struct FitPoints {
    std::vector<double> u, v, t, count;
    std::size_t size = 0;  ///< without those that fill up

    void clear();
    void add(double at_u, double at_v, double at_t, double its_count) {
        u.push_back(at_u);
        v.push_back(at_v);
        t.push_back(at_t);
        count.push_back(its_count);
        ++size;
    }
    void fill_up();
};

/// Weight of a point: count * near, near = (1 - u^2 - v^2 - t^2)^2.
struct FitSums {
    double moments[15] = {};            ///< of u^a v^b: 1 | u v | uu uv vv | uuu uuv uvv vvv | uuuu uuuv uuvv uvvv vvvv
    double heights[6] = {};             ///< of t times 1 u v uu uv vv
    double squares = 0;                 ///< of count * near^2
    double near = 0, near_squares = 0;  ///< without the counts
};
[[nodiscard]] FitSums fit_sums(const FitPoints& points);

/// Of t - height, height = x0 + x1 u + x2 v + x3 uu + x4 uv + x5 vv; near is (1 - u^2 - v^2)^2 here, without t: else
/// noise would seem smaller where the ball is hardly larger than it.
struct FitResidual {
    double squares = 0;  ///< sum of count * near * (t - height)^2
    double weight = 0;   ///< of count * near
    double near = 0;     ///< of near
};
[[nodiscard]] FitResidual fit_residual(const FitPoints& points, const double x[6]);

}  // namespace covol::cloud
