#include "image/geometry_check.h"

#include <algorithm>
#include <cmath>

#include "base/number.h"
#include "covol/error.h"
#include "limits/world_limits.h"

namespace covol::detail {
namespace {

/// @throws Error Unsupported unless the axes are perpendicular and of length 1.
void check_direction(const std::string& where, const ImageGeometry& g) {
    constexpr double kTolerance = 1e-3;
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b <= a; ++b) {
            double dot = 0;
            for (int c = 0; c < 3; ++c) dot += g.direction[c][a] * g.direction[c][b];
            if (!(std::abs(dot - (a == b ? 1.0 : 0.0)) <= kTolerance))
                throw Error(Errc::Unsupported,
                            where +
                                ": direction: expected perpendicular axes of length 1, got sheared or degenerate "
                                "ones; resample the image",
                            "direction");
        }
}

}  // namespace

void check_geometry(const std::string& where, const ImageGeometry& g) {
    const auto refuse = [&](const char* what, const std::string& expected, double got, int axis, const char* advice) {
        throw Error(Errc::InvalidInput,
                    where + ": " + what + ": expected " + expected + ", got " + number(got) + " along axis " +
                        std::to_string(axis) + "; " + advice,
                    what);
    };
    double finest = kLargestLength;
    for (int a = 0; a < 3; ++a) {
        if (!(g.spacing[a] >= kLeastLength && g.spacing[a] * g.size[a] <= kLargestLength))
            refuse("spacing",
                   "from " + number(kLeastLength) + ", with " + std::to_string(g.size[a]) + " voxels up to " +
                       number(kLargestLength / g.size[a]),
                   g.spacing[a], a, "state it in another unit (`spacing`)");
        finest = std::min(finest, g.spacing[a]);
    }
    const double farthest = farthest_origin(finest);
    for (int a = 0; a < 3; ++a)
        if (!(std::abs(g.origin[a]) <= farthest))
            refuse("origin", "within " + number(farthest) + " of 0", g.origin[a], a,
                   "farther away voxels cannot be told apart well: move the image");
    check_direction(where, g);
}

}  // namespace covol::detail
